// What happens to a controller from outside, and when: faults injected by name, and a scene's list of them.
#include <algorithm>
#include <limits>

#include "sim/controller_state.hpp"
#include "weldcell/sim/fault_schedule.hpp"

namespace weldcell::sim {

namespace {
constexpr double kRestart_s = 5;
constexpr double kCollisionBrake_s = 0.05;  // motion supervision stops with all the torque there is
}  // namespace

void ControllerState::set_auto(bool automatic) {
  if (automatic == truth.auto_mode) return;
  truth.auto_mode = automatic;
  manual_full_speed = false;
  rmmp = {};
  stop_program("operating mode changed");
  if (panel == PanelState::MotorsOn) set_panel(PanelState::MotorsOff);
  log(1, automatic ? 10017 : 10015, automatic ? "Automatic mode confirmed" : "Manual mode selected");
}

void ControllerState::restart(double duration_s) {
  stop_program("controller restart");
  set_panel(PanelState::MotorsOff);
  egm.end();
  egm_interrupted = false;
  task.clear_pointer();
  mastership.clear();
  mastership_ids.clear();
  rmmp = {};
  rapid_state_unknown = truth.rapid_state_lost;
  ++restarts;
  fault_until_s["restart"] = seconds(now.ns) + (duration_s > 0 ? duration_s : kRestart_s);
}

void ControllerState::collide() {
  log(3, 50204, "Motion supervision", "Motion supervision triggered for axis 1 on mechanical unit ROB_1");
  stop_program("motion supervision");
  // The motors stay on; what moved comes to rest at once, wherever it is, and the rest of the path is gone.
  start_ramp(kCollisionBrake_s);
}

void ControllerState::come_near_singularity() {
  if (drive != Drive::Egm) {
    singular_ahead = true;
    return;
  }
  log(3, 50027, "Joint Out of Range", "EGM reference leads out of a joint's working range");
  stop_program("joint out of range");
}

void ControllerState::move_pointer() {
  if (!pointer_moves || executing() || !path.at_rest()) return;
  pointer_moves = false;
  if (!task.set_pointer("", "main")) task.clear_pointer();
  path.reset(reference);
  egm_interrupted = false;
  log(1, 10002, "Program pointer has been reset", "The program pointer of task T_ROB1 has been reset");
}

void ControllerState::end_faults() {
  for (auto fault = fault_until_s.begin(); fault != fault_until_s.end();) {
    if (seconds(now.ns) < fault->second) {
      ++fault;
      continue;
    }
    if (fault->first == "estop") set_panel(PanelState::EmergencyStopReset);
    if (fault->first == "guardstop") set_panel(PanelState::MotorsOff);
    if (fault->first == "manual") set_auto(true);
    if (fault->first == "restart") {
      started_at = now;
      log(1, 10045, "System restarted", "An already installed system was restarted");
    }
    fault = fault_until_s.erase(fault);
  }
}

bool Controller::inject(const std::string& fault, double duration_s) {
  ControllerState& s = *state_;
  const double until =
      duration_s > 0 ? seconds(s.now.ns) + duration_s : std::numeric_limits<double>::infinity();
  if (fault == "estop") {
    s.set_panel(PanelState::EmergencyStop);
    s.fault_until_s[fault] = until;
  } else if (fault == "guardstop") {
    s.set_panel(PanelState::GuardStop);
    s.fault_until_s[fault] = until;
  } else if (fault == "motors_off") {
    s.set_panel(PanelState::MotorsOff);
  } else if (fault == "motors_on") {
    // The button on the cabinet: without effect while an emergency stop or a guard stop stands.
    if (s.panel == PanelState::MotorsOff || s.panel == PanelState::EmergencyStopReset)
      s.set_panel(PanelState::MotorsOn);
  } else if (fault == "program_stop") {
    s.stop_program("stopped at the pendant");
  } else if (fault == "pp_moved") {
    s.stop_program("stopped at the pendant");
    s.pointer_moves = true;
  } else if (fault == "collision") {
    s.collide();
  } else if (fault == "singularity") {
    s.come_near_singularity();
  } else if (fault == "manual") {
    s.set_auto(false);
    if (duration_s > 0) s.fault_until_s[fault] = until;
  } else if (fault == "restart") {
    s.restart(duration_s);
  } else if (fault == "egm_silence" || fault == "rws_503" || fault == "rws_silence") {
    s.fault_until_s[fault] = until;
  } else if (fault == "robot_clock_step" || fault == "robot_clock_back") {
    // Somebody sets the controller's clock.
    const double by_s = duration_s > 0 ? duration_s : 1;
    s.truth.clock.offset_s += fault == "robot_clock_step" ? by_s : -by_s;
  } else {
    return false;
  }
  return true;
}

void Controller::bound_axis(std::size_t axis, double lower_rad, double upper_rad) {
  ControllerState& s = *state_;
  s.arm.lower.at(axis) = lower_rad;
  s.arm.upper.at(axis) = upper_rad;
  s.path.set_arm(s.arm);
  s.egm.set_arm(s.arm);
}

FaultSchedule::FaultSchedule(const std::vector<TimedFault>& faults) {
  for (const TimedFault& fault : faults) add(fault, {});
}

void FaultSchedule::add(const TimedFault& fault, HostTime now) {
  Waiting waiting{fault};
  if (fault.after == TimedFault::After::Start) waiting.since_s = seconds(now.ns);
  waiting_.push_back(waiting);
}

std::vector<TimedFault> FaultSchedule::due(HostTime now, const Controller& controller) {
  const double t = seconds(now.ns);
  std::vector<TimedFault> out;
  std::erase_if(waiting_, [&](Waiting& waiting) {
    const bool begun =
        waiting.fault.after == TimedFault::After::Scan ? controller.egm_guiding() : controller.arc_on();
    if (!waiting.since_s && begun) waiting.since_s = t;
    if (!waiting.since_s || t < *waiting.since_s + waiting.fault.at_s) return false;
    out.push_back(waiting.fault);
    return true;
  });
  return out;
}

}  // namespace weldcell::sim
