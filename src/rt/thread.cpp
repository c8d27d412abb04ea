#include "weldcell/rt/thread.hpp"

#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <memory>
#include <utility>

namespace weldcell::rt {

namespace {

struct Start {
  std::function<void()> body;
  int nice = 0;
};

void* run(void* argument) {
  const std::unique_ptr<Start> start(static_cast<Start*>(argument));
  if (start->nice != 0) {
    // On Linux the niceness belongs to the thread.
    ::setpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)), start->nice);
  }
  start->body();
  return nullptr;
}

}  // namespace

Result<Thread> Thread::start(const ThreadOptions& options, std::function<void()> body) {
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, options.stack_bytes);
  auto start = std::make_unique<Start>(Start{std::move(body), options.fifo_priority > 0 ? 0 : options.nice});
  Thread thread;
  const int made = pthread_create(&thread.handle_, &attributes, &run, start.get());
  pthread_attr_destroy(&attributes);
  if (made != 0) {
    return Error{"rt.thread", options.name, std::strerror(made), "raise the limit of tasks (TasksMax=) or memory"};
  }
  start.release();
  thread.running_ = true;
  pthread_setname_np(thread.handle_, options.name.substr(0, 15).c_str());
  if (options.fifo_priority > 0) {
    sched_param parameters{};
    parameters.sched_priority = options.fifo_priority;
    thread.fifo_granted_ = pthread_setschedparam(thread.handle_, SCHED_FIFO, &parameters) == 0;
  }
  return thread;
}

Thread::Thread(Thread&& other) noexcept { *this = std::move(other); }

Thread& Thread::operator=(Thread&& other) noexcept {
  if (this == &other) return *this;
  join();
  handle_ = other.handle_;
  fifo_granted_ = other.fifo_granted_;
  running_ = std::exchange(other.running_, false);
  return *this;
}

Thread::~Thread() { join(); }

void Thread::join() {
  if (!std::exchange(running_, false)) return;
  pthread_join(handle_, nullptr);
}

Status lock_memory() {
  if (::mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return Done{};
  return Error{"rt.mlock", "mlockall", std::strerror(errno), "set LimitMEMLOCK=infinity in the unit"};
}

}  // namespace weldcell::rt
