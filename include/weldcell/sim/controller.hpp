// The simulated ABB controller: EGM by the documented control law, RWS 1.0 requests, and RAPID that moves the arm. Single-
// threaded and clockless: whoever owns it gives the time. Built from the protocol facts, never from the daemon.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "weldcell/base/time.hpp"
#include "weldcell/kinematics/arm_model.hpp"
#include "weldcell/ports/http.hpp"
#include "weldcell/sim/scene.hpp"

namespace weldcell::sim {

/// A stretch that the torch welded: TCP positions in Base while the arc burned.
struct WeldTrace {
  std::string seam;
  std::vector<Eigen::Vector3d> tcp_mm;
};

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
  /// One authenticated RWS 1.0 request (digest, cookies and sessions are the server's matter).
  ports::HttpReply handle_rws(const ports::HttpRequest& request);

  /// True arm posture now (not what EGM reports).
  const kinematics::Joints& joints() const;
  /// True postures at earlier instants, for the laser: interpolated inside the last second.
  kinematics::Joints joints_at(HostTime t) const;
  const std::vector<WeldTrace>& weld_traces() const;
  /// Faults from outside: "estop", "motors_off", "egm_silence", "program_stop", ...
  void inject(const std::string& fault);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace weldcell::sim
