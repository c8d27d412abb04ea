// RAPID instructions of the simulated controller: which there are, waiting, signals, numbers, words.
#include <cmath>

#include "sim/instruction.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::sim {

using rapid::Call;
using rapid::RapidError;
using rapid::Value;

bool Instruction::run() {
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
                                                        {"egmactpose", &Instruction::egm_act_pose},
                                                        {"egmrunpose", &Instruction::egm_run_pose},
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

void Instruction::wait_time() {
  ControllerState& s = s_;
  if (switched(call_, "inpos")) waits_.push_back([&s] { return s.path.idle(); });
  wait_seconds(call_.at(0).value.number);
}

void Instruction::wait_signal() {
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

void Instruction::set_signal() {
  Value* storage = call_.at(0).storage;
  if (!storage) throw RapidError{rapid::kErrArgument, call_.name + ": not a signal", 40160};
  storage->number = call_.name == "set" ? 1 : call_.name == "reset" ? 0 : call_.at(1).value.number;
}

void Instruction::step_number() {
  Value* storage = call_.at(0).storage;
  if (!storage || storage->kind != Value::Kind::Number) {
    throw RapidError{rapid::kErrArgument, call_.name + ": needs a variable of type num", 40160};
  }
  if (call_.name == "clear") storage->number = 0;
  if (call_.name == "incr") storage->number += 1;
  if (call_.name == "decr") storage->number -= 1;
  if (call_.name == "add") storage->number += call_.at(1).value.number;
}

void Instruction::write() {
  std::string text;
  for (std::size_t i = 0; i < call_.positional(); ++i) text += (i ? " " : "") + call_.at(i).value.text;
  if (const auto* shown = call_.option("num")) text += rapid::print(shown->value);
  if (const auto* shown = call_.option("bool")) text += rapid::print(shown->value);
  s_.log(1, 80001, call_.name == "tpwrite" ? "TPWrite" : "ErrWrite", text);
}

void Instruction::conf() {
  (call_.name == "confl" ? s_.configuration_line : s_.configuration_joint) = switched(call_, "on");
}

void Instruction::sing_area() {
  if (switched(call_, "wrist")) s_.log(2, 40199, "SingArea \\Wrist", "is taken as \\Off by this simulator");
}

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
