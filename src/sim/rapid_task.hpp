// One RAPID task: program pointer, call stack, ERROR handling. Runs a few statements a cycle. Pure.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "sim/rapid_memory.hpp"

namespace weldcell::sim::rapid {

struct ActualArgument {
  std::string option;      ///< "" = positional
  std::string name;        ///< of the datum, when the argument is a plain reference
  bool has_value = false;  ///< false for a switch
  Value value;
  Value* storage = nullptr;  ///< the datum itself, when it can be written
};

/// One instruction about to run.
struct Call {
  std::string name;
  std::vector<ActualArgument> arguments;
  int line = 0;
  std::string routine;
  /// Positional argument i; throws RapidError when it is missing.
  const ActualArgument& at(std::size_t i) const;
  const ActualArgument* option(const std::string& name) const;
  std::size_t positional() const;
};

/// What the machine understands. An instruction may queue waits: functions that return true when they are
/// over.
class Machine {
 public:
  using Wait = std::function<bool()>;
  virtual ~Machine() = default;
  /// Starts an instruction; false when the name is unknown. Throws RapidError.
  virtual bool begin(const Call& call, std::deque<Wait>& waits) = 0;
  /// The program stopped by itself: end, EXIT, Stop, or an error nobody handled.
  virtual void on_program_event(int event, const std::string& what, bool error) = 0;
};

class Task {
 public:
  Task(Memory& memory, Machine& machine) : memory_(memory), machine_(machine) {}

  /// PP to a routine; false when there is none.
  bool set_pointer(const std::string& module, const std::string& routine);
  void clear_pointer();
  bool has_pointer() const { return !frames_.empty() || !entry_routine_.empty(); }
  bool uses(const std::string& module) const;
  /// Where PP stands: module, routine, line; empty when it is not set.
  struct Position {
    std::string module, routine;
    int line = 0;
  };
  Position position() const;

  bool running() const { return running_; }
  bool start(bool forever);
  void stop() { running_ = false; }
  void set_forever(bool forever) { forever_ = forever; }
  bool forever() const { return forever_; }

  /// Executes statements until one waits, the program ends or `budget` is used up.
  void run(int budget);
  /// An error from outside the statement now waiting (e.g. EGM time-out).
  bool waiting() const { return !waits_.empty(); }

 private:
  struct Cursor {
    const Block* block = nullptr;
    std::size_t next = 0;
    bool loop = false;  ///< at its end the statement that opened it runs again
    std::string for_name;
    double for_to = 0, for_step = 0;
  };
  struct Frame {
    std::shared_ptr<const Module> module;
    const Routine* routine = nullptr;
    DataMap locals;
    std::vector<Cursor> cursors, failed_at;
    bool handling = false;
    std::deque<Machine::Wait> interrupted;  ///< of a trap: what was being waited for when it came
  };
  /// CONNECT and IPers: which trap runs when a persistent changes.
  struct Interrupt {
    std::string trap;  ///< lower case
    std::string module, persistent;
    Value seen;
  };

  bool enter();
  void push(const Routine& routine, const std::vector<ActualArgument>& arguments);
  void leave();
  void advance();
  void execute(const Statement& statement);
  void call(const Statement& statement, const std::string& name);
  void branch(const Statement& statement);
  void repeat(const Statement& statement);
  void end_of_block();
  void raise(const RapidError& error);
  void resume_after_error(bool retry);
  void finish(int event, const std::string& what, bool error);
  bool interrupt_instruction(const Call& call);
  void take_interrupts();
  std::vector<ActualArgument> evaluate(const std::vector<Argument>& arguments, const Scope& scope);
  bool truth(const Expression& expression, const Scope& scope);
  void assign(const Statement& statement, const Scope& scope);
  Scope scope() { return {&frames_.back().locals, frames_.back().routine->module}; }

  Memory& memory_;
  Machine& machine_;
  std::string entry_module_, entry_routine_;
  std::vector<Frame> frames_;
  std::deque<Machine::Wait> waits_;
  std::map<double, Interrupt> interrupts_;  ///< by the number in the intnum
  double last_interrupt_ = 0;
  bool running_ = false;
  bool forever_ = false;
};

}  // namespace weldcell::sim::rapid
