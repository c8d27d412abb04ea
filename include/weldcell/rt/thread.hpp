// A named thread with its own stack size and scheduling; says what the kernel granted. Made by app/ only.
#pragma once

#include <pthread.h>

#include <functional>
#include <string>

#include "weldcell/base/result.hpp"

namespace weldcell::rt {

struct ThreadOptions {
  std::string name;                      ///< at most 15 characters
  int fifo_priority = 0;                 ///< 0: ordinary scheduling
  int nice = 0;                          ///< ordinary scheduling only
  std::size_t stack_bytes = 512 * 1024;
};

/// Joins when it goes out of scope; the body must end by itself.
class Thread {
 public:
  Thread() = default;
  /// Runs `body` on a new thread. Error "rt.thread" when it cannot be made. A refused FIFO is no error: fifo_granted().
  static Result<Thread> start(const ThreadOptions& options, std::function<void()> body);
  Thread(Thread&& other) noexcept;
  Thread& operator=(Thread&& other) noexcept;
  ~Thread();

  void join();
  /// Whether the wanted priority was given; true when none was wanted.
  bool fifo_granted() const { return fifo_granted_; }

 private:
  pthread_t handle_{};
  bool running_ = false;
  bool fifo_granted_ = true;
};

/// Locks present and future pages into memory, so that the real-time thread never waits for the disk.
/// Error "rt.mlock" with the mend.
Status lock_memory();

}  // namespace weldcell::rt
