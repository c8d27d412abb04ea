// Interrupts of the simulated RAPID task: CONNECT, IPers, IDelete, and the trap that runs between two cycles.
#include <utility>

#include "sim/rapid_task.hpp"

namespace weldcell::sim::rapid {

namespace {

RapidError misuse(const std::string& what) { return {kErrArgument, what, 40160}; }

}  // namespace

bool Task::interrupt_instruction(const Call& call) {
  const auto number = [&call](std::size_t i) -> Value& {
    Value* storage = call.at(i).storage;
    if (storage == nullptr || storage->kind != Value::Kind::Number)
      throw misuse(call.name + ": argument " + std::to_string(i + 1) + " is no intnum variable");
    return *storage;
  };
  if (call.name == "connect") {
    const Routine* trap = memory_.routine(frames_.back().routine->module, call.at(1).value.text);
    if (trap == nullptr || !trap->trap) throw misuse("CONNECT: no trap " + call.at(1).value.text);
    Value& own = number(0);
    if (interrupts_.contains(own.number)) throw misuse("CONNECT: the interrupt is connected already");
    own.number = ++last_interrupt_;
    interrupts_[own.number].trap = trap->name;
    return true;
  }
  if (call.name == "idelete") {
    interrupts_.erase(number(0).number);
    return true;
  }
  if (call.name != "ipers") return false;
  const auto found = interrupts_.find(number(1).number);
  if (found == interrupts_.end()) throw misuse("IPers: the interrupt is not connected");
  found->second.module = frames_.back().routine->module;
  found->second.persistent = lower(call.at(0).name);
  found->second.seen = call.at(0).value;
  return true;
}

void Task::take_interrupts() {
  // One at a time: a trap is not interrupted by another.
  for (const Frame& frame : frames_) {
    if (frame.routine->trap) return;
  }
  for (auto& [number, interrupt] : interrupts_) {
    const Datum* datum =
        interrupt.persistent.empty() ? nullptr : memory_.symbol(interrupt.module, interrupt.persistent);
    if (datum == nullptr || datum->value == interrupt.seen) continue;
    interrupt.seen = datum->value;
    if (frames_.empty()) return;
    const Routine* trap = memory_.routine(interrupt.module, interrupt.trap);
    if (trap == nullptr) return;
    push(*trap, {});
    frames_.back().interrupted = std::exchange(waits_, {});
    return;
  }
}

}  // namespace weldcell::sim::rapid
