#include "sim/rapid_task.hpp"

#include <utility>

namespace weldcell::sim::rapid {

namespace {
constexpr std::size_t kMaxCallDepth = 200;
}

const ActualArgument& Call::at(std::size_t i) const {
  for (const ActualArgument& argument : arguments) {
    if (argument.option.empty() && i-- == 0) return argument;
  }
  throw RapidError{kErrArgument, name + ": an argument is missing", 40160};
}

const ActualArgument* Call::option(const std::string& wanted) const {
  for (const ActualArgument& argument : arguments) {
    if (argument.option == wanted) return &argument;
  }
  return nullptr;
}

std::size_t Call::positional() const {
  std::size_t count = 0;
  for (const ActualArgument& argument : arguments) count += argument.option.empty();
  return count;
}

bool Task::set_pointer(const std::string& module, const std::string& routine) {
  const Routine* found = memory_.routine(module, routine);
  if (!found || found->trap || (!module.empty() && found->module != module) || !found->parameters.empty())
    return false;
  clear_pointer();
  entry_module_ = found->module;
  entry_routine_ = routine;
  return true;
}

void Task::clear_pointer() {
  frames_.clear();
  waits_.clear();
  interrupts_.clear();
  entry_module_.clear();
  entry_routine_.clear();
}

bool Task::uses(const std::string& module) const {
  if (entry_module_ == module) return true;
  for (const Frame& frame : frames_) {
    if (frame.routine->module == module) return true;
  }
  return false;
}

Task::Position Task::position() const {
  if (frames_.empty()) return {entry_module_, entry_routine_, 0};
  const Frame& frame = frames_.back();
  const Cursor* cursor = frame.cursors.empty() ? nullptr : &frame.cursors.back();
  const int line = cursor && cursor->next < cursor->block->size() ? (*cursor->block)[cursor->next].line
                                                                  : frame.routine->line;
  return {frame.module->display, frame.routine->display, line};
}

bool Task::start(bool forever) {
  if (!has_pointer() || running_) return false;
  forever_ = forever;
  if (frames_.empty() && !enter()) return false;
  running_ = true;
  return true;
}

bool Task::enter() {
  const Routine* routine = memory_.routine(entry_module_, entry_routine_);
  if (!routine) return false;
  push(*routine, {});
  return true;
}

void Task::push(const Routine& routine, const std::vector<ActualArgument>& arguments) {
  if (frames_.size() >= kMaxCallDepth) throw RapidError{kErrNotHandled, "calls nested too deep", 40199};
  Frame frame;
  frame.module = memory_.module(routine.module);
  frame.routine = &routine;
  if (arguments.size() != routine.parameters.size()) {
    throw RapidError{kErrArgument,
                     routine.display + " takes " + std::to_string(routine.parameters.size()) + " arguments",
                     40160};
  }
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    Datum datum;
    datum.type = routine.parameters[i].type;
    datum.display = routine.parameters[i].name;
    datum.value = arguments[i].value;
    if (Status fits = memory_.types().fit(datum.value, datum.type, {}); !fits) {
      throw RapidError{kErrArgument, routine.display + ": " + fits.error().text(), 40160};
    }
    frame.locals[routine.parameters[i].name] = std::move(datum);
  }
  for (const Declaration& declaration : routine.data) {
    frame.locals[declaration.name] = memory_.make_datum(declaration, {&frame.locals, routine.module});
  }
  frame.cursors.push_back({&routine.body, 0, false, "", 0, 0});
  frames_.push_back(std::move(frame));
}

void Task::advance() {
  if (!frames_.empty() && !frames_.back().cursors.empty()) ++frames_.back().cursors.back().next;
}

void Task::leave() {
  const bool trap = frames_.back().routine->trap;
  if (trap) waits_ = std::move(frames_.back().interrupted);
  frames_.pop_back();
  if (trap && !frames_.empty()) return;  // the statement that was interrupted goes on
  if (!frames_.empty()) {
    advance();
    return;
  }
  if (forever_ && enter()) return;
  finish(10122, "program ended", false);
}

void Task::finish(int event, const std::string& what, bool error) {
  running_ = false;
  waits_.clear();
  machine_.on_program_event(event, what, error);
}

void Task::run(int budget) {
  bool looked = false;
  while (running_ && budget-- > 0) {
    try {
      if (!std::exchange(looked, true)) take_interrupts();
      while (!waits_.empty()) {
        if (!waits_.front()()) return;
        waits_.pop_front();
        if (waits_.empty()) advance();
      }
      if (frames_.empty()) {
        finish(10122, "program ended", false);
        return;
      }
      Cursor& cursor = frames_.back().cursors.back();
      if (cursor.next >= cursor.block->size()) {
        end_of_block();
      } else {
        execute((*cursor.block)[cursor.next]);
      }
    } catch (const RapidError& error) {
      waits_.clear();
      raise(error);
    }
  }
}

void Task::end_of_block() {
  Frame& frame = frames_.back();
  const Cursor done = frame.cursors.back();
  if (done.loop && !done.for_name.empty()) {
    Value& variable = frame.locals[done.for_name].value;
    variable.number += done.for_step;
    if (done.for_step > 0 ? variable.number <= done.for_to : variable.number >= done.for_to) {
      frame.cursors.back().next = 0;
      return;
    }
    frame.cursors.pop_back();
    advance();
    return;
  }
  if (frame.cursors.size() > 1) {
    frame.cursors.pop_back();
    if (!done.loop) advance();
    return;
  }
  leave();
}

void Task::execute(const Statement& statement) {
  switch (statement.kind) {
    case Statement::Kind::Assign:
      assign(statement, scope());
      advance();
      return;
    case Statement::Kind::Call:
      call(statement, statement.name);
      return;
    case Statement::Kind::LateCall:
      call(statement, lower(memory_.evaluate(*statement.target, scope()).text));
      return;
    case Statement::Kind::If:
    case Statement::Kind::Test:
      branch(statement);
      return;
    case Statement::Kind::While:
    case Statement::Kind::For:
      repeat(statement);
      return;
    case Statement::Kind::Return:
      leave();
      return;
    case Statement::Kind::Exit:
      clear_pointer();
      finish(10123, "program ended by EXIT", false);
      return;
    case Statement::Kind::Stop:
      advance();
      finish(10124, "program stopped by Stop", false);
      return;
    case Statement::Kind::Retry:
      resume_after_error(true);
      return;
    case Statement::Kind::TryNext:
      resume_after_error(false);
      return;
    case Statement::Kind::Raise: {
      const Datum* number = memory_.symbol("", "errno");
      RapidError error{static_cast<int>(number->value.number), "RAISE", 40199};
      if (statement.target)
        error.number = static_cast<int>(memory_.evaluate(*statement.target, scope()).number);
      raise(error);
      return;
    }
  }
}

std::vector<ActualArgument> Task::evaluate(const std::vector<Argument>& arguments, const Scope& where) {
  std::vector<ActualArgument> out;
  for (const Argument& argument : arguments) {
    ActualArgument actual;
    actual.option = argument.option;
    if (argument.value) {
      actual.has_value = true;
      if (argument.value->kind == Expression::Kind::Reference) {
        Datum* owner = nullptr;
        Value* storage = memory_.resolve(*argument.value, where, &owner);
        actual.value = *storage;
        actual.name = owner->display;
        if (owner->storage != Storage::Constant) actual.storage = storage;
      } else {
        actual.value = memory_.evaluate(*argument.value, where);
      }
    }
    out.push_back(std::move(actual));
  }
  return out;
}

void Task::call(const Statement& statement, const std::string& name) {
  const Routine* routine = memory_.routine(frames_.back().routine->module, name);
  if (routine && !routine->trap) {
    push(*routine, evaluate(statement.arguments, scope()));
    return;
  }
  Call call;
  call.name = name;
  call.line = statement.line;
  call.routine = frames_.back().routine->display;
  call.arguments = evaluate(statement.arguments, scope());
  if (interrupt_instruction(call)) return advance();
  if (!machine_.begin(call, waits_)) {
    throw RapidError{kErrReferenceUnknown, "routine or instruction '" + name + "' is not known", 40165};
  }
  if (waits_.empty()) advance();
}

bool Task::truth(const Expression& expression, const Scope& where) {
  const Value value = memory_.evaluate(expression, where);
  if (value.kind != Value::Kind::Boolean) throw RapidError{kErrNotHandled, "condition is not a bool", 40199};
  return value.flag;
}

void Task::branch(const Statement& statement) {
  Value subject;
  if (statement.kind == Statement::Kind::Test) subject = memory_.evaluate(*statement.target, scope());
  for (const Branch& arm : statement.branches) {
    bool taken = arm.conditions.empty();
    for (const ExpressionPtr& condition : arm.conditions) {
      taken =
          taken || (statement.kind == Statement::Kind::Test ? memory_.evaluate(*condition, scope()) == subject
                                                            : truth(*condition, scope()));
    }
    if (!taken) continue;
    frames_.back().cursors.push_back({&arm.body, 0, false, "", 0, 0});
    return;
  }
  advance();
}

void Task::repeat(const Statement& statement) {
  const Block& body = statement.branches[0].body;
  if (statement.kind == Statement::Kind::While) {
    if (truth(*statement.target, scope())) {
      frames_.back().cursors.push_back({&body, 0, true, "", 0, 0});
    } else {
      advance();
    }
    return;
  }
  const double from = memory_.evaluate(*statement.value, scope()).number;
  const double to = memory_.evaluate(*statement.to, scope()).number;
  const double step = statement.step ? memory_.evaluate(*statement.step, scope()).number
                      : from <= to   ? 1
                                     : -1;
  if (step == 0 || (step > 0 ? from > to : from < to)) {
    advance();
    return;
  }
  Datum variable;
  variable.type = "num";
  variable.display = statement.name;
  variable.value = Value::of(from);
  frames_.back().locals[statement.name] = std::move(variable);
  frames_.back().cursors.push_back({&body, 0, true, statement.name, to, step});
}

void Task::assign(const Statement& statement, const Scope& where) {
  Value value = memory_.evaluate(*statement.value, where);
  Datum* owner = nullptr;
  std::string type;
  Value* storage = memory_.resolve(*statement.target, where, &owner, &type);
  if (owner->storage == Storage::Constant)
    throw RapidError{kErrNotHandled, owner->display + " is a constant", 40199};
  std::vector<int> dimensions;
  if (storage->kind == Value::Kind::Array) dimensions.push_back(static_cast<int>(storage->items.size()));
  if (dimensions.empty() || storage == &owner->value) {
    if (Status fits =
            memory_.types().fit(value, type, storage == &owner->value ? owner->dimensions : dimensions);
        !fits) {
      throw RapidError{kErrNotHandled, owner->display + ": " + fits.error().text(), 40199};
    }
  }
  *storage = std::move(value);
}

void Task::raise(const RapidError& error) {
  if (frames_.empty()) {
    finish(error.event, error.what, true);
    return;
  }
  const Position at = position();
  const std::string place = at.module + "/" + at.routine + " line " + std::to_string(at.line) + ": ";
  if (error.number != kErrNotHandled) {
    // The nearest routine up the call chain with a handler takes it; the frames above it are gone.
    for (std::size_t level = frames_.size(); level-- > 0;) {
      Frame& frame = frames_[level];
      if (!frame.routine->has_error_handler || frame.handling) continue;
      frames_.resize(level + 1);
      memory_.symbol("", "errno")->value = Value::of(double(error.number));
      frame.failed_at = frame.cursors;
      frame.handling = true;
      frame.cursors = {{&frame.routine->error_handler, 0, false, "", 0, 0}};
      return;
    }
  }
  finish(error.event, place + error.what, true);
}

void Task::resume_after_error(bool retry) {
  Frame& frame = frames_.back();
  if (!frame.handling) throw RapidError{kErrNotHandled, "RETRY or TRYNEXT outside an error handler", 40199};
  frame.cursors = std::move(frame.failed_at);
  frame.failed_at.clear();
  frame.handling = false;
  if (!retry) advance();
}

}  // namespace weldcell::sim::rapid
