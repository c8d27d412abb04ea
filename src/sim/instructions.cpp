// RAPID instructions of the simulated controller: motion, arc welding, EGM, signals, waiting.
#include <cmath>

#include "sim/controller_state.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::sim {

using rapid::Call;
using rapid::RapidError;
using rapid::Value;
using Wait = rapid::Machine::Wait;
using Waits = std::deque<Wait>;

namespace {

constexpr double kQuaternionTolerance = 1e-5;
constexpr std::size_t kMovesAhead = 2;  // fly-by moves that the program runs ahead of the arm

double number(const Value& value, std::size_t i) { return value.items.at(i).number; }

Eigen::Isometry3d pose_of(const Value& trans, const Value& rot, const std::string& what) {
  const Eigen::Quaterniond q(number(rot, 0), number(rot, 1), number(rot, 2), number(rot, 3));
  if (std::abs(q.norm() - 1) > kQuaternionTolerance) {
    throw RapidError{rapid::kErrNotHandled, what + ": orientation is not normalized", 40199};
  }
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.linear() = q.normalized().toRotationMatrix();
  out.translation() = Eigen::Vector3d(number(trans, 0), number(trans, 1), number(trans, 2));
  return out;
}

const Value& shaped(const Call& call, std::size_t i, std::size_t components, const char* type) {
  const Value& value = call.at(i).value;
  if (value.items.size() != components) {
    throw RapidError{rapid::kErrArgument,
                     call.name + ": argument " + std::to_string(i + 1) + " is not a " + type, 40160};
  }
  return value;
}

Eigen::Isometry3d tool_of(const Value& tool, const std::string& what) {
  if (tool.items.size() != 3) throw RapidError{rapid::kErrArgument, what + ": not a tooldata", 40160};
  if (!tool.items[0].flag)
    throw RapidError{rapid::kErrNotHandled, what + ": stationary tools are not supported", 40199};
  if (number(tool.items[2], 0) <= 0)
    throw RapidError{rapid::kErrNotHandled, what + ": tool load has no mass", 41438};
  return pose_of(tool.items[1].items[0], tool.items[1].items[1], what);
}

Eigen::Isometry3d wobj_of(const Value& wobj, const std::string& what) {
  if (wobj.items.size() != 5) throw RapidError{rapid::kErrArgument, what + ": not a wobjdata", 40160};
  if (wobj.items[0].flag || !wobj.items[1].flag) {
    throw RapidError{rapid::kErrNotHandled, what + ": moving work objects are not supported", 40199};
  }
  return pose_of(wobj.items[3].items[0], wobj.items[3].items[1], what) *
         pose_of(wobj.items[4].items[0], wobj.items[4].items[1], what);
}

Eigen::Isometry3d wobj_option(const Call& call) {
  const auto* wobj = call.option("wobj");
  return wobj ? wobj_of(wobj->value, call.name) : Eigen::Isometry3d::Identity();
}

bool switched(const Call& call, const char* on) { return call.option(on) != nullptr; }

double option_number(const Call& call, const char* name, double otherwise) {
  const auto* option = call.option(name);
  return option && option->has_value ? option->value.number : otherwise;
}

RapidError motion_fault(const Error& error) {
  if (error.code == "motion.reach") return {rapid::kErrNotHandled, error.text(), 50050};
  if (error.code == "motion.configuration") return {rapid::kErrNotHandled, error.text(), 50080};
  if (error.code == "motion.singular") return {rapid::kErrNotHandled, error.text(), 50026};
  return {rapid::kErrNotHandled, error.text(), 40199};
}

/// Runs the instructions of one call against the controller's state.
class Instruction {
 public:
  Instruction(ControllerState& s, const Call& call, Waits& waits) : s_(s), call_(call), waits_(waits) {}

  bool run() {
    using Handler = void (Instruction::*)();
    static const std::map<std::string, Handler> kHandlers{{"moveabsj", &Instruction::move_abs_j},
                                                          {"movej", &Instruction::move_j},
                                                          {"movel", &Instruction::move_l},
                                                          {"movec", &Instruction::move_c},
                                                          {"arclstart", &Instruction::arc_l_start},
                                                          {"arcl", &Instruction::arc_l},
                                                          {"arclend", &Instruction::arc_l_end},
                                                          {"arcc", &Instruction::arc_c},
                                                          {"arccend", &Instruction::arc_c_end},
                                                          {"waittime", &Instruction::wait_time},
                                                          {"waitdo", &Instruction::wait_signal},
                                                          {"waitdi", &Instruction::wait_signal},
                                                          {"set", &Instruction::set_signal},
                                                          {"reset", &Instruction::set_signal},
                                                          {"setdo", &Instruction::set_signal},
                                                          {"setgo", &Instruction::set_signal},
                                                          {"setao", &Instruction::set_signal},
                                                          {"incr", &Instruction::step_number},
                                                          {"decr", &Instruction::step_number},
                                                          {"add", &Instruction::step_number},
                                                          {"clear", &Instruction::step_number},
                                                          {"tpwrite", &Instruction::write},
                                                          {"errwrite", &Instruction::write},
                                                          {"confl", &Instruction::conf},
                                                          {"confj", &Instruction::conf},
                                                          {"egmreset", &Instruction::egm_reset},
                                                          {"egmgetid", &Instruction::egm_get_id},
                                                          {"egmsetupuc", &Instruction::egm_setup},
                                                          {"egmactjoint", &Instruction::egm_act},
                                                          {"egmrunjoint", &Instruction::egm_run},
                                                          {"egmwaitcond", &Instruction::egm_wait},
                                                          {"egmstop", &Instruction::egm_stop},
                                                          {"waitrob", &Instruction::wait_rob},
                                                          {"velset", &Instruction::nothing},
                                                          {"accset", &Instruction::nothing},
                                                          {"singarea", &Instruction::sing_area},
                                                          {"tperase", &Instruction::nothing},
                                                          {"pathacclim", &Instruction::nothing}};
    const auto handler = kHandlers.find(call_.name);
    if (handler == kHandlers.end()) return false;
    (this->*handler->second)();
    return true;
  }

 private:
  // ---- motion ----
  Move base_move(std::size_t speed, std::size_t zone, std::size_t tool) {
    Move out;
    const Value& v = shaped(call_, speed, 4, "speeddata");
    const Value& z = shaped(call_, zone, 7, "zonedata");
    out.speed_mm_s = option_number(call_, "v", number(v, 0));
    out.turn_rad_s = rad(std::max(number(v, 1), 0.1));
    if (out.speed_mm_s <= 0)
      throw RapidError{rapid::kErrNotHandled, call_.name + ": speed must be above 0", 40199};
    out.fine = z.items[0].flag;
    out.tool = tool_of(call_.at(tool).value, call_.name);
    return out;
  }

  Eigen::Isometry3d target(std::size_t i) {
    const Value& p = shaped(call_, i, 4, "robtarget");
    return wobj_option(call_) *
           pose_of(p.items[0], p.items[1], call_.at(i).name.empty() ? call_.name : call_.at(i).name);
  }

  kinematics::Configuration configuration(std::size_t i) {
    const Value& c = call_.at(i).value.items.at(2);
    return {static_cast<int>(number(c, 0)), static_cast<int>(number(c, 1)), static_cast<int>(number(c, 2)),
            static_cast<int>(number(c, 3))};
  }

  void start(const Move& move) {
    ControllerState& s = s_;
    if (s.drive != Drive::Path)
      throw RapidError{rapid::kErrNotHandled, "motion while EGM guides the arm", 41826};
    if (Status added = s.path.add(move); !added) throw motion_fault(added.error());
    if (move.fine) {
      waits_.push_back([&s] { return s.path.idle(); });
    } else {
      waits_.push_back([&s] { return s.path.queued() <= kMovesAhead; });
    }
  }

  void move_abs_j() {
    Move move = base_move(1, 2, 3);
    const Value& j = shaped(call_, 0, 2, "jointtarget");
    for (std::size_t i = 0; i < 6; ++i) move.joints[i] = rad(number(j.items[0], i));
    start(move);
  }

  void move_j() {
    Move move = base_move(1, 2, 3);
    const Eigen::Isometry3d flange = target(0) * move.tool.inverse();
    const auto solutions = kinematics::inverse(s_.arm, {flange}, s_.path.end());
    if (solutions.empty())
      throw RapidError{rapid::kErrNotHandled, call_.at(0).name + ": position outside reach", 50050};
    const kinematics::Joints* chosen = nullptr;
    for (const auto& solution : solutions) {
      if (chosen) break;
      if (!s_.configuration_joint || kinematics::configuration(s_.arm, solution) == configuration(0))
        chosen = &solution;
    }
    if (!chosen) {
      throw RapidError{rapid::kErrNotHandled,
                       call_.at(0).name + ": not reached in the programmed configuration", 50080};
    }
    move.joints = *chosen;
    start(move);
  }

  Move path_move(std::size_t to, std::size_t speed, std::size_t zone, std::size_t tool) {
    Move move = base_move(speed, zone, tool);
    move.kind = Move::Kind::Line;
    move.target = target(to);
    move.check_configuration = s_.configuration_line;
    move.configuration = configuration(to);
    return move;
  }
  void move_l() { start(path_move(0, 1, 2, 3)); }
  void move_c() {
    Move move = path_move(1, 2, 3, 4);
    move.kind = Move::Kind::Circle;
    move.via = target(0);
    start(move);
  }

  void wait_rob() {
    ControllerState& s = s_;
    waits_.push_back([&s] { return s.path.idle(); });
  }

  // ---- arc welding ----
  void wait_seconds(double duration_s) {
    ControllerState& s = s_;
    if (duration_s <= 0) return;
    // Counted from when the wait is reached, not from when it was queued.
    waits_.push_back([&s, duration_s, end = -1.0]() mutable {
      if (end < 0) end = s.run_time_s + duration_s;
      return s.run_time_s >= end - 1e-9;
    });
  }

  const Value& seam(std::size_t i) { return shaped(call_, i, 16, "seamdata"); }
  double weld_speed(std::size_t i) {
    const double speed = number(shaped(call_, i, 4, "welddata"), 0);
    if (speed <= 0)
      throw RapidError{rapid::kErrNotHandled, call_.name + ": weld_speed must be above 0", 110001};
    return speed;
  }

  void arc_l_start() {
    Move move = path_move(0, 1, 4, 5);
    move.fine = true;
    ControllerState& s = s_;
    const Value& data = seam(2);
    weld_speed(3);
    std::string name = call_.routine;
    if (const auto* given = call_.option("seamname"); given && !given->value.text.empty())
      name = given->value.text;
    start(move);
    wait_seconds(number(data, 0) + number(data, 1));
    waits_.push_back([&s, name, tool = move.tool] {
      s.arc_on = true;
      s.arc_tool = tool;
      s.welds.push_back({name, {}});
      if (auto* signal = s.memory.symbol("", "doarcon")) signal->value.number = 1;
      return true;
    });
    wait_seconds(number(data, 3));
  }

  void arc_move(Move move, std::size_t seam_at) {
    if (!s_.arc_on) throw RapidError{rapid::kErrNotHandled, call_.name + " without ArcLStart", 110002};
    move.speed_mm_s = weld_speed(seam_at + 1);
    (void)seam(seam_at);
    start(move);
  }

  void arc_off(std::size_t seam_at) {
    ControllerState& s = s_;
    const Value& data = seam(seam_at);
    wait_seconds(number(data, 9) + number(data, 10));
    waits_.push_back([&s] {
      s.arc_on = false;
      if (auto* signal = s.memory.symbol("", "doarcon")) signal->value.number = 0;
      return true;
    });
    wait_seconds(number(data, 15));
  }

  void arc_l() { arc_move(path_move(0, 1, 4, 5), 2); }
  void arc_l_end() {
    Move move = path_move(0, 1, 4, 5);
    move.fine = true;
    arc_move(move, 2);
    arc_off(2);
  }
  Move circle() {
    Move move = path_move(1, 2, 5, 6);
    move.kind = Move::Kind::Circle;
    move.via = target(0);
    return move;
  }
  void arc_c() { arc_move(circle(), 3); }
  void arc_c_end() {
    Move move = circle();
    move.fine = true;
    arc_move(move, 3);
    arc_off(3);
  }

  // ---- waiting, signals, numbers, words ----
  void wait_time() {
    ControllerState& s = s_;
    if (switched(call_, "inpos")) waits_.push_back([&s] { return s.path.idle(); });
    wait_seconds(call_.at(0).value.number);
  }

  void wait_signal() {
    const Value* storage = call_.at(0).storage;
    if (!storage) throw RapidError{rapid::kErrArgument, call_.name + ": not a signal", 40160};
    ControllerState& s = s_;
    const double wanted = call_.at(1).value.number;
    const double until = s.run_time_s + option_number(call_, "maxtime", 1e12);
    waits_.push_back([&s, storage, wanted, until] {
      if (storage->number == wanted) return true;
      if (s.run_time_s > until)
        throw RapidError{rapid::kErrWaitTimeOut, "waiting for a signal took too long", 41001};
      return false;
    });
  }

  void set_signal() {
    Value* storage = call_.at(0).storage;
    if (!storage) throw RapidError{rapid::kErrArgument, call_.name + ": not a signal", 40160};
    storage->number = call_.name == "set" ? 1 : call_.name == "reset" ? 0 : call_.at(1).value.number;
  }

  void step_number() {
    Value* storage = call_.at(0).storage;
    if (!storage || storage->kind != Value::Kind::Number) {
      throw RapidError{rapid::kErrArgument, call_.name + ": needs a variable of type num", 40160};
    }
    if (call_.name == "clear") storage->number = 0;
    if (call_.name == "incr") storage->number += 1;
    if (call_.name == "decr") storage->number -= 1;
    if (call_.name == "add") storage->number += call_.at(1).value.number;
  }

  void write() {
    std::string text;
    for (std::size_t i = 0; i < call_.positional(); ++i) text += (i ? " " : "") + call_.at(i).value.text;
    if (const auto* shown = call_.option("num")) text += rapid::print(shown->value);
    if (const auto* shown = call_.option("bool")) text += rapid::print(shown->value);
    s_.log(1, 80001, call_.name == "tpwrite" ? "TPWrite" : "ErrWrite", text);
  }

  void conf() {
    (call_.name == "confl" ? s_.configuration_line : s_.configuration_joint) = switched(call_, "on");
  }
  void sing_area() {
    if (switched(call_, "wrist")) s_.log(2, 40199, "SingArea \\Wrist", "is taken as \\Off by this simulator");
  }
  void nothing() {}

  // ---- EGM ----
  [[noreturn]] void state_fault() {
    throw RapidError{rapid::kErrNotHandled, call_.name + ": EGM state change error", 41826};
  }

  void egm_reset() {
    if (s_.drive == Drive::Egm) s_.start_ramp(s_.egm_run.ramp_out_s);
    s_.egm.reset();
    s_.egm_timed_out = s_.egm_interrupted = false;
  }

  void egm_get_id() {
    s_.egm.get_id();
    if (Value* id = call_.at(0).storage; id && !id->items.empty()) id->items[0].number = 1;
  }

  void egm_setup() {
    if (!switched(call_, "joint") && !switched(call_, "pose")) {
      throw RapidError{rapid::kErrArgument, "EGMSetupUC: this simulator knows \\Joint only", 40160};
    }
    if (s_.egm.state() == EgmState::Disconnected) state_fault();
    s_.egm.set_up(option_number(call_, "commtimeout", 1.0));
  }

  void egm_act() {
    EgmActivation& a = s_.egm_activation = {};
    a.low_pass_hz = option_number(call_, "lpfilter", s_.egm.default_low_pass_hz());
    a.max_speed_deviation_rad_s = rad(option_number(call_, "maxspeeddeviation", 1.0));
    a.max_position_deviation_rad = rad(option_number(call_, "maxposdeviation", 1000.0));
    a.sample_cycles = std::max(1, static_cast<int>(std::lround(option_number(call_, "samplerate", 4) / 4)));
    a.stream = switched(call_, "streamstart");
    if (const auto* tool = call_.option("tool")) a.tool = tool_of(tool->value, "EGMActJoint");
    a.wobj = wobj_option(call_);
    for (std::size_t i = 0; i < 6; ++i) {
      a.min_rad[i] = rad(-0.5);
      a.max_rad[i] = rad(0.5);
      if (const auto* band = call_.option("j" + std::to_string(i + 1));
          band && band->value.items.size() == 2) {
        a.min_rad[i] = rad(number(band->value, 0));
        a.max_rad[i] = rad(number(band->value, 1));
      }
    }
    if (!s_.egm.activate(a)) state_fault();
  }

  void egm_run() {
    EgmRun run;
    bool any = false;
    for (std::size_t i = 0; i < 6; ++i)
      any |= run.axes[i] = switched(call_, ("j" + std::to_string(i + 1)).c_str());
    if (!any) return;
    run.cond_time_s = option_number(call_, "condtime", 1);
    run.ramp_in_s = option_number(call_, "rampintime", 0);
    run.ramp_out_s = option_number(call_, "rampouttime", 0.5);
    run.position_gain_share = std::clamp(option_number(call_, "poscorrgain", 1), 0.0, 1.0);
    const bool wait = !switched(call_, "nowaitcond");
    ControllerState& s = s_;
    // Guidance begins in a fine point: the arm stands before it.
    waits_.push_back([&s, run, wait] {
      if (!s.path.idle() || s.drive != Drive::Path) return false;
      s.egm_timed_out = false;
      s.egm_run = run;
      if (!s.egm.run(run, s.reference)) {
        throw RapidError{rapid::kErrNotHandled, "EGMRunJoint: EGM state change error", 41826};
      }
      s.drive = Drive::Egm;
      s.egm_wait = wait;
      return true;
    });
    if (wait) egm_wait();
  }

  void egm_wait() {
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

  void egm_stop() {
    s_.egm.end();
    if (s_.drive == Drive::Egm) s_.start_ramp(option_number(call_, "rampouttime", s_.egm_run.ramp_out_s));
    ControllerState& s = s_;
    waits_.push_back([&s] { return s.drive == Drive::Path; });
  }

  ControllerState& s_;
  const Call& call_;
  Waits& waits_;
};

}  // namespace

bool ControllerState::begin(const Call& call, std::deque<Wait>& waits) {
  return Instruction(*this, call, waits).run();
}

std::optional<Value> ControllerState::machine_function(const std::string& name,
                                                       const std::vector<Value>& arguments) {
  if (name == "cjointt") {
    Value joints, unused, out;
    joints.kind = unused.kind = out.kind = Value::Kind::Record;
    for (const double joint : servo.posture()) {
      joints.items.push_back(Value::of(deg(joint)));
      unused.items.push_back(Value::of(9e9));
    }
    out.items = {joints, unused};
    return out;
  }
  if (name == "opmode") return Value::of(truth.auto_mode ? 1.0 : 2.0);
  if (name == "egmgetstate") return Value::of(static_cast<double>(egm.state()));
  if ((name == "doutput" || name == "dinput" || name == "testdi") && arguments.size() == 1) {
    if (name == "testdi") return Value::of(arguments[0].number != 0);
    return arguments[0];
  }
  return std::nullopt;
}

}  // namespace weldcell::sim
