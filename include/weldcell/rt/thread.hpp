// A thread with name, scheduling and stack size, which says what the system granted; and locked memory. Not
// real-time safe.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include "weldcell/base/result.hpp"

namespace weldcell::rt {

struct ThreadOptions {
  std::string name;       ///< at most 15 characters are shown by the system
  int fifo_priority = 0;  ///< 1..99: SCHED_FIFO; 0: ordinary scheduling
  int nice = 0;           ///< of an ordinary thread
  std::size_t stack_bytes = 256 * 1024;
};

/// Runs from start() until its body returns; joins when destroyed, so end the body first.
class Thread {
 public:
  /// Error "thread.start" when the system makes no thread. A refused FIFO priority is no error: see
  /// fifo_granted().
  static Result<Thread> start(const ThreadOptions& options, std::function<void()> body);

  Thread(Thread&& other) noexcept;
  Thread& operator=(Thread&& other) noexcept;
  ~Thread();

  void join();
  const std::string& name() const;
  /// False when a FIFO priority was asked for and refused: the thread runs with ordinary scheduling.
  bool fifo_granted() const;

 private:
  struct State;
  explicit Thread(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Keeps all memory of the process, present and future, out of the swap. Error "memory.lock" names the cause.
Status lock_memory();

}  // namespace weldcell::rt
