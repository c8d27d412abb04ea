#include "weldcell/rt/thread.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstring>
#include <future>
#include <utility>

namespace weldcell::rt {

struct Thread::State {
  ThreadOptions options;
  std::function<void()> body;
  std::promise<bool> set_up;
  bool fifo_granted = false;
  bool joined = false;
  pthread_t handle{};

  static void* run(void* argument) {
    auto& state = *static_cast<State*>(argument);
    const ThreadOptions& o = state.options;
    pthread_setname_np(pthread_self(), o.name.substr(0, 15).c_str());
    bool granted = true;
    if (o.fifo_priority > 0) {
      sched_param parameter{};
      parameter.sched_priority = o.fifo_priority;
      granted = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter) == 0;
    } else if (o.nice != 0) {
      setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), o.nice);
    }
    state.set_up.set_value(granted);
    state.body();
    return nullptr;
  }
};

Thread::Thread(std::unique_ptr<State> state) : state_(std::move(state)) {}
Thread::Thread(Thread&& other) noexcept = default;

Thread& Thread::operator=(Thread&& other) noexcept {
  join();
  state_ = std::move(other.state_);
  return *this;
}

Thread::~Thread() { join(); }

Result<Thread> Thread::start(const ThreadOptions& options, std::function<void()> body) {
  auto state = std::make_unique<State>();
  state->options = options;
  state->body = std::move(body);
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, std::max<std::size_t>(options.stack_bytes, PTHREAD_STACK_MIN));
  const int fault = pthread_create(&state->handle, &attributes, &State::run, state.get());
  pthread_attr_destroy(&attributes);
  if (fault != 0) {
    return Error{"thread.start", options.name,
                 std::string("the system made no thread: ") + std::strerror(fault),
                 "raise the limit of tasks (systemd: TasksMax)"};
  }
  state->fifo_granted = state->set_up.get_future().get();
  return Thread(std::move(state));
}

void Thread::join() {
  if (!state_ || state_->joined) return;
  pthread_join(state_->handle, nullptr);
  state_->joined = true;
}

const std::string& Thread::name() const { return state_->options.name; }
bool Thread::fifo_granted() const { return state_->fifo_granted; }

Status lock_memory() {
  // ONFAULT: what is touched stays; the tens of megabytes of libraries that never run are not read in.
  if (mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0) return Done{};
  return Error{"memory.lock", "mlockall", std::strerror(errno), "set LimitMEMLOCK=infinity in the unit"};
}

}  // namespace weldcell::rt
