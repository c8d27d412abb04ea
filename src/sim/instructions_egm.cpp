// EGM of the simulated controller: set up, activate, run and stop, in joints or as poses.
#include <cmath>

#include "sim/instruction.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::sim {

using rapid::Call;
using rapid::RapidError;
using rapid::Value;

void Instruction::state_fault() {
  throw RapidError{rapid::kErrNotHandled, call_.name + ": EGM state change error", 41826};
}

void Instruction::egm_reset() {
  if (s_.drive == Drive::Egm) s_.start_ramp(s_.egm_run.ramp_out_s);
  s_.egm.reset();
  s_.egm_timed_out = s_.egm_interrupted = false;
}

void Instruction::egm_get_id() {
  s_.egm.get_id();
  if (Value* id = call_.at(0).storage; id && !id->items.empty()) id->items[0].number = 1;
}

void Instruction::egm_setup() {
  if (!switched(call_, "joint") && !switched(call_, "pose")) {
    throw RapidError{rapid::kErrArgument, "EGMSetupUC: this simulator knows \\Joint and \\Pose only", 40160};
  }
  if (s_.egm.state() == EgmState::Disconnected) state_fault();
  const std::string data = call_.at(2).value.text, device = call_.at(3).value.text;
  if (!find_row(s_.configuration, "MOC", "EXT_MOTION_DATA", data) ||
      !find_row(s_.configuration, "SIO", "COM_TRP", device)) {
    throw RapidError{rapid::kErrArgument,
                     "EGMSetupUC: no external motion data '" + data + "' or no UdpUc device '" + device + "'",
                     40160};
  }
  s_.egm.set_up(option_number(call_, "commtimeout", 1.0));
}

/// What EGMActJoint and EGMActPose have in common.
void Instruction::common_activation(EgmActivation& a, const char* name) {
  a.low_pass_hz = option_number(call_, "lpfilter", s_.egm.default_low_pass_hz());
  a.max_speed_deviation_rad_s = rad(option_number(call_, "maxspeeddeviation", 1.0));
  a.max_position_deviation_rad = rad(option_number(call_, "maxposdeviation", 1000.0));
  a.sample_cycles = std::max(1, static_cast<int>(std::lround(option_number(call_, "samplerate", 4) / 4)));
  a.stream = switched(call_, "streamstart");
  if (const auto* tool = call_.option("tool")) a.tool = tool_of(tool->value, name);
  a.wobj = wobj_option(call_);
}

void Instruction::egm_act() {
  EgmActivation& a = s_.egm_activation = {};
  common_activation(a, "EGMActJoint");
  for (std::size_t i = 0; i < 6; ++i) {
    a.min_rad[i] = rad(-0.5);
    a.max_rad[i] = rad(0.5);
    if (const auto* band = call_.option("j" + std::to_string(i + 1)); band && band->value.items.size() == 2) {
      a.min_rad[i] = rad(number(band->value, 0));
      a.max_rad[i] = rad(number(band->value, 1));
    }
  }
  if (!s_.egm.activate(a)) state_fault();
}

/// A frame argument followed by what it is relative to, in Base.
Eigen::Isometry3d Instruction::frame_of(std::size_t frame, std::size_t type) {
  const Value& pose = shaped(call_, frame, 2, "pose");
  const Eigen::Isometry3d own = pose_of(pose.items[0], pose.items[1], call_.name);
  const auto relative = static_cast<EgmFrameType>(static_cast<int>(call_.at(type).value.number));
  if (relative == EgmFrameType::Base || relative == EgmFrameType::World) return own;
  if (relative == EgmFrameType::Wobj) return s_.egm_activation.wobj * own;
  throw RapidError{rapid::kErrArgument, "EGMActPose: this simulator knows base, world and wobj frames only",
                   40160};
}

void Instruction::egm_act_pose() {
  EgmActivation& a = s_.egm_activation = {};
  common_activation(a, "EGMActPose");
  a.pose = true;
  const Eigen::Isometry3d correction = frame_of(1, 2);
  a.sensor = frame_of(3, 4);
  if (!correction.isApprox(a.sensor, 1e-9))
    throw RapidError{rapid::kErrArgument, "EGMActPose: correction and sensor frame must be the same here",
                     40160};
  const char* const names[] = {"x", "y", "z", "rx", "ry", "rz"};
  for (std::size_t i = 0; i < 6; ++i) {
    const auto* band = call_.option(names[i]);
    const bool given = band && band->value.items.size() == 2;
    const double usual = i < 3 ? 1.0 : 0.5;
    a.pose_min[i] = given ? number(band->value, 0) : -usual;
    a.pose_max[i] = given ? number(band->value, 1) : usual;
  }
  if (!s_.egm.activate(a)) state_fault();
}

void Instruction::egm_run() {
  EgmRun run;
  bool any = false;
  for (std::size_t i = 0; i < 6; ++i)
    any |= run.axes[i] = switched(call_, ("j" + std::to_string(i + 1)).c_str());
  if (s_.egm_activation.pose) state_fault();
  if (any) begin_guidance(run);
}

void Instruction::egm_run_pose() {
  EgmRun run;
  run.axes.fill(true);
  int named = 0;
  for (const char* axis : {"x", "y", "z", "rx", "ry", "rz"}) named += switched(call_, axis) ? 1 : 0;
  if (!s_.egm_activation.pose) state_fault();
  if (named != 0 && named != 6)
    throw RapidError{rapid::kErrArgument, "EGMRunPose: this simulator moves all six directions or none",
                     40160};
  if (named == 6) begin_guidance(run);
}

void Instruction::begin_guidance(const EgmRun& asked) {
  EgmRun run = asked;
  run.cond_time_s = option_number(call_, "condtime", 1);
  run.ramp_in_s = option_number(call_, "rampintime", 0);
  run.ramp_out_s = option_number(call_, "rampouttime", 0.5);
  run.position_gain_share = std::clamp(option_number(call_, "poscorrgain", 1), 0.0, 1.0);
  const bool wait = !switched(call_, "nowaitcond");
  ControllerState& s = s_;
  // Guidance begins in a fine point: the arm stands before it.
  waits_.push_back([&s, run, wait, name = call_.name] {
    if (!s.path.idle() || s.drive != Drive::Path) return false;
    s.egm_timed_out = false;
    s.egm_run = run;
    if (!s.egm.run(run, s.reference)) {
      throw RapidError{rapid::kErrNotHandled, name + ": EGM state change error", 41826};
    }
    s.drive = Drive::Egm;
    s.egm_wait = wait;
    return true;
  });
  if (wait) egm_wait();
}

void Instruction::egm_wait() {
  ControllerState& s = s_;
  waits_.push_back([&s] {
    s.egm_wait = true;
    if (s.egm.guiding() || s.drive != Drive::Path) return false;
    s.egm_wait = false;
    s.egm.end();
    if (std::exchange(s.egm_timed_out, false)) {
      throw RapidError{rapid::kErrUdpUcComm, "no data from the UdpUc device", 41822};
    }
    return true;
  });
}

void Instruction::egm_stop() {
  s_.egm.end();
  if (s_.drive == Drive::Egm) s_.start_ramp(option_number(call_, "rampouttime", s_.egm_run.ramp_out_s));
  ControllerState& s = s_;
  waits_.push_back([&s] { return s.drive == Drive::Path; });
}

}  // namespace weldcell::sim
