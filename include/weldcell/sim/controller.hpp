// The simulated ABB controller: EGM by the documented control law, RWS requests of both generations, and
// RAPID that moves the arm. Single-threaded and clockless: whoever owns it gives the time. Built from the
// protocol facts, never from the daemon.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "weldcell/base/time.hpp"
#include "weldcell/kinematics/arm_model.hpp"
#include "weldcell/ports/http.hpp"
#include "weldcell/sim/scene.hpp"

namespace weldcell::sim {

/// An entry of the event log.
struct Event {
  int number = 0;  ///< of the entry, from 1
  int type = 1;    ///< 1 information, 2 warning, 3 error
  int code = 0;    ///< the controller's event number, e.g. 41822
  HostTime at;
  std::string title, text;
};

/// What a subscribed RWS resource shows now, as the entry of an event frame.
struct RwsObserved {
  std::string type, title, self;  ///< class and title of the entry, href of its own link
  std::vector<std::pair<std::string, std::string>> fields;
  bool quick = false;  ///< an I/O signal or a persistent: may be subscribed with high priority
  bool operator==(const RwsObserved&) const = default;
};

struct ControllerState;

class Controller {
 public:
  Controller(const Scene& scene, const kinematics::ArmModel& arm);
  ~Controller();

  /// Advances servo, RAPID and EGM by one cycle (scene.controller.cycle) to true time `now`.
  void step(HostTime now);
  /// The EgmRobot datagram that is due after this step; empty when EGM does not send.
  std::optional<std::vector<std::byte>> egm_datagram();
  /// An EgmSensor datagram from the PC; malformed ones are counted and logged as an event, never harmful.
  void on_egm_datagram(std::span<const std::byte> datagram);
  /// One authenticated RWS request (credentials, cookies and sessions are the server's matter). Mastership
  /// belongs to a session.
  ports::HttpReply handle_rws(const ports::HttpRequest& request, int session = 0);
  /// The session logged out or expired: what it held is free.
  void end_rws_session(int session);

  /// The value of a resource as a subscription names it, with its ";suffix"; empty when there is none.
  std::optional<RwsObserved> observe_rws(const std::string& uri);
  /// 1 or 2.
  int rws_generation() const;
  /// A restart is under way: nothing answers; and how often that happened.
  bool restarting() const;
  /// Robot Web Services answer nothing now, not even a refusal: a restart, or the network is gone.
  bool rws_silent() const;
  std::uint64_t restarts() const;

  /// True arm posture now (not what EGM reports).
  const kinematics::Joints& joints() const;
  /// True postures for the laser: the last two seconds, and ahead as far as the servo's dead time has decided
  /// them. step() must have been called at equal intervals of the cycle.
  kinematics::Joints joints_at(HostTime t) const;
  const std::vector<WeldTrace>& weld_traces() const;
  /// Every motion of the arm so far, whatever moved it; rests shorter than 0.1 s do not part two of them.
  const std::vector<MotionSpan>& motions() const;
  bool arc_on() const;
  /// From outside: "estop", "guardstop", "motors_off", "motors_on" (the button), "manual", "program_stop",
  /// "pp_moved" (stopped, then the pointer to main), "collision" (motion supervision), "singularity" (of the
  /// next move), "restart", "egm_silence", "rws_503", "rws_silence". Those that last end after duration_s (0:
  /// never; a restart takes 5 s). False when the kind is unknown.
  bool inject(const std::string& fault, double duration_s = 0);
  /// Bounds an axis (0..5) as the controller's own configuration does, rad, about where it stands: targets
  /// and references beyond are refused from now on by whatever meets them (50027 in EGM, 50050 or 50080 in
  /// RAPID).
  void bound_axis(std::size_t axis, double lower_rad, double upper_rad);

  /// Loads a module as a disk restart would: no mastership needed. Error "rapid.*".
  Status load_module(const std::string& text);
  bool motors_on() const;
  bool program_running() const;
  bool egm_guiding() const;
  /// Programs that ended (by end, EXIT, Stop or error) since the start.
  std::uint64_t programs_ended() const;
  std::uint64_t malformed_egm_datagrams() const;
  const std::vector<Event>& events() const;

 private:
  std::unique_ptr<ControllerState> state_;
};

}  // namespace weldcell::sim
