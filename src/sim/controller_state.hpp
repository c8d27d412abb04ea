// Everything inside the simulated controller, shared by its cycle, its RAPID instructions and its RWS
// handler. Private.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sim/configuration.hpp"
#include "sim/egm_channel.hpp"
#include "sim/path_motion.hpp"
#include "sim/rapid_task.hpp"
#include "sim/servo.hpp"
#include "weldcell/sim/controller.hpp"

namespace weldcell::sim {

enum class PanelState { MotorsOff, MotorsOn, GuardStop, EmergencyStop, EmergencyStopReset };
const char* to_string(PanelState state);

/// Remote access in manual mode, which a person grants at the pendant.
struct ManualPrivilege {
  int session = 0;        ///< that asked; 0: nobody
  std::string privilege;  ///< "modify" or "exec"
  int polls = 0;          ///< the person grants at the second
  bool granted() const { return session != 0 && polls >= 2; }
};

/// What moves the reference in this cycle.
enum class Drive { Path, Egm, Ramp };

struct ControllerState final : rapid::Machine {
  ControllerState(const Scene& scene, const kinematics::ArmModel& arm_model);

  // ---- cycle (controller.cpp) ----
  void step(HostTime now_);
  void move_reference();
  void start_ramp(double duration_s);
  void record_weld();
  void record_motion(const kinematics::Joints& before);
  void set_panel(PanelState next);
  bool start_program(bool forever);
  void stop_program(const std::string& why);
  /// RAPID runs, or the arm still ramps to rest after it: what Robot Web Services call running.
  bool executing() const { return task.running() || drive == Drive::Ramp; }
  /// The key on the cabinet: the program stops and the motors go off when it turns.
  void set_auto(bool automatic);
  /// Warm start: program stopped, motors off, EGM ended, mastership gone; RWS is away for a while.
  void restart(double duration_s);
  /// Motion supervision: event 50204, the program stops, the motors stay on.
  void collide();
  /// The next RAPID move leads through the wrist's singularity (50026); guided by EGM, a joint leaves its
  /// range now (50027).
  void come_near_singularity();
  /// Once the arm rests, carries out a wish to have the program pointer moved to main.
  void move_pointer();
  void end_faults();
  bool restarting() const { return fault_until_s.contains("restart"); }
  /// Name and value of every I/O signal, in order: the cell's own, then idle ones as on any real cabinet.
  std::vector<std::pair<std::string, double>> signals();
  void set_signal(const std::string& name, double value);
  void log(int type, int code, const std::string& title, const std::string& text = "");
  const char* operation_mode() const {
    return truth.auto_mode ? "AUTO" : manual_full_speed ? "MANF" : "MANR";
  }
  bool motors_on() const { return panel == PanelState::MotorsOn; }
  std::int64_t device_us(HostTime t) const;
  std::vector<std::byte> egm_frame();

  // ---- rapid::Machine (instructions.cpp) ----
  bool begin(const rapid::Call& call, std::deque<Wait>& waits) override;
  void on_program_event(int event, const std::string& what, bool error) override;
  std::optional<rapid::Value> machine_function(const std::string& name,
                                               const std::vector<rapid::Value>& arguments);

  ControllerTruth truth;
  kinematics::ArmModel arm;
  double cycle_s;
  HostTime now;
  double run_time_s = 0;  ///< RAPID's own time: stands while the program is stopped

  rapid::Memory memory;
  rapid::Task task;
  EgmChannel egm;
  PathMotion path;
  Servo servo;

  PanelState panel = PanelState::MotorsOff;
  Drive drive = Drive::Path;
  kinematics::Joints reference{}, reference_speed{}, ramp_speed{};
  double ramp_left_s = 0, ramp_total_s = 0;
  double speed_ratio = 1;

  EgmActivation egm_activation;
  EgmRun egm_run;
  bool egm_timed_out = false, egm_wait = false, egm_interrupted = false;
  double complaint_after_s = 0;
  std::optional<std::vector<std::byte>> datagram;

  bool configuration_line = true, configuration_joint = true;
  bool arc_on = false;
  Eigen::Isometry3d arc_tool = Eigen::Isometry3d::Identity();
  std::vector<WeldTrace> welds;
  std::vector<MotionSpan> motions;
  bool singular_ahead = false, pointer_moves = false;

  std::map<std::string, double> fault_until_s;  ///< lasting faults; infinity = for good
  std::vector<Event> events;
  int event_number = 0;
  std::uint64_t programs_ended = 0;
  std::map<std::string, int> mastership;      ///< domain -> session that holds it
  std::map<std::string, int> mastership_ids;  ///< domain -> id given with it, where one was asked for
  int last_mastership_id = 0;
  ManualPrivilege rmmp;
  bool manual_full_speed = false;
  bool rapid_state_unknown = false;
  double calendar_set_s = 0;  ///< by which a client moved the calendar
  Configuration configuration;
  std::map<std::string, std::string> files;  ///< $HOME, lower-case path -> content
  std::set<std::string> folders;             ///< below $HOME, lower-case paths
  int generation = 1;                        ///< of RWS
  std::uint64_t restarts = 0;
  HostTime started_at;
  std::map<std::string, double> idle_signals;
};

}  // namespace weldcell::sim
