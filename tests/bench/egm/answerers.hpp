// Who answers frames in this bench: the daemon's own EGM thread, and a bare echo.
#pragma once

#include <netinet/in.h>
#include <pthread.h>
#include <sched.h>
#include <sys/socket.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <thread>

#include "app/device_threads.hpp"
#include "rt/counting_allocator.hpp"
#include "weldcell/adapters/egm_udp.hpp"
#include "weldcell/adapters/fd.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/rt/thread.hpp"

namespace weldcell::bench {

inline double cpu_us(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) * 1e6 + static_cast<double>(t.tv_nsec) * 1e-3;
}

inline void sleep_until(HostTime t) {
  const timespec at{t.ns / kSecond, t.ns % kSecond};
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr) == EINTR) {
  }
}

inline sockaddr_in loopback(int port) {
  sockaddr_in out{};
  out.sin_family = AF_INET;
  out.sin_port = htons(static_cast<std::uint16_t>(port));
  out.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return out;
}

/// Somebody who answers datagrams on a FIFO thread of its own.
struct Answerer {
  int port = 0;
  std::atomic<bool> ready{false};
  clockid_t cpu_clock{};
  std::uint64_t allocations = 0;  ///< between the first frame and the end
  bool fifo = false;

  void on_thread() {
    pthread_getcpuclockid(pthread_self(), &cpu_clock);
    ready.store(true, std::memory_order_release);
  }
};

inline constexpr int kFifo = 70;

/// recv, send, nothing else.
class Echo : public Answerer {
 public:
  Echo() : fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in local = loopback(0);
    if (::bind(fd_.get(), reinterpret_cast<sockaddr*>(&local), sizeof local) != 0) std::abort();
    socklen_t size = sizeof local;
    ::getsockname(fd_.get(), reinterpret_cast<sockaddr*>(&local), &size);
    port = ntohs(local.sin_port);
    auto started = rt::Thread::start({"echo", kFifo, 0, 256 * 1024}, [this] { run(); });
    fifo = started->fifo_granted();
    thread_ = std::make_unique<rt::Thread>(std::move(*started));
  }
  ~Echo() {
    stopping_ = true;
    const sockaddr_in to = loopback(port);
    ::sendto(fd_.get(), "x", 1, 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
    thread_.reset();
  }

 private:
  void run() {
    on_thread();
    std::byte buffer[2048];
    while (!stopping_) {
      sockaddr_in from{};
      socklen_t size = sizeof from;
      const ssize_t n =
          ::recvfrom(fd_.get(), buffer, sizeof buffer, 0, reinterpret_cast<sockaddr*>(&from), &size);
      if (n > 0)
        ::sendto(fd_.get(), buffer, static_cast<std::size_t>(n), 0, reinterpret_cast<sockaddr*>(&from), size);
    }
  }
  adapters::Fd fd_;
  std::atomic<bool> stopping_{false};
  std::unique_ptr<rt::Thread> thread_;
};

/// Swings every axis for a long time, sampled on the controller's cycle.
inline plan::MotionPlan long_motion(double seconds) {
  plan::MotionPlan plan;
  plan.id = 1;
  const auto count = static_cast<std::size_t>(seconds / plan.period_s);
  plan.samples.resize(count);
  for (std::size_t k = 0; k < count; ++k) {
    const double w = 2 * kPi / 4, t = w * plan.period_s * static_cast<double>(k);
    for (std::size_t i = 0; i < 6; ++i) {
      const double reach = rad(5.0 + static_cast<double>(i));
      plan.samples[k].q[i] = (i == 4 ? rad(90) : 0) + reach * (1 - std::cos(t)) / 2;
      plan.samples[k].qd[i] = reach * w * std::sin(t) / 2;
    }
  }
  return plan;
}

/// The daemon's EGM thread as the daemon runs it, and its cell thread's draining of the ring.
class Daemon : public Answerer {
 public:
  Daemon(const files::CellConfig& config, double motion_s)
      : wiring_(std::make_unique<app::Wiring>(config)), plan_(long_motion(motion_s)) {
    auto bound = adapters::EgmSocket::bind("127.0.0.1", 0, "127.0.0.1");
    if (!bound.ok()) std::abort();
    socket_ = std::make_unique<adapters::EgmSocket>(std::move(*bound));
    port = socket_->port();
    wiring_->session.set_armed(true);
    auto started = rt::Thread::start({"egm", kFifo, 0, 256 * 1024}, [this] {
      const auto before = rt::allocation_count();
      on_thread();
      app::run_egm(*wiring_, *socket_);
      allocations = rt::allocation_count().allocations - before.allocations;
    });
    fifo = started->fifo_granted();
    thread_ = std::make_unique<rt::Thread>(std::move(*started));
    drain_ = std::thread([this] {
      while (!stopped_) {
        while (wiring_->egm.pop(item_)) last_ = item_.report;
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    });
  }
  /// Ends the threads; afterwards allocations and report are final.
  void end() {
    if (!thread_) return;
    wiring_->stopping = true;
    thread_.reset();
    stopped_ = true;
    drain_.join();
    while (wiring_->egm.pop(item_)) last_ = item_.report;
  }
  ~Daemon() { end(); }
  void offer() { wiring_->offered_plan.store(&plan_); }
  const robot::EgmReport& report() const { return last_; }
  std::uint64_t dropped() const { return wiring_->egm.dropped(); }

 private:
  std::unique_ptr<app::Wiring> wiring_;
  plan::MotionPlan plan_;
  std::unique_ptr<adapters::EgmSocket> socket_;
  std::unique_ptr<rt::Thread> thread_;
  std::thread drain_;
  std::atomic<bool> stopped_{false};
  app::EgmItem item_;
  robot::EgmReport last_;
};

}  // namespace weldcell::bench
