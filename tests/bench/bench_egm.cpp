// The daemon's EGM reply (send to reply) beside a bare recv/send echo in the same run, at 250 Hz and 1 kHz
// and beside stress-ng. usage: bench_egm [--json] [--seconds S] [--minutes M] [--no-stress]
//   --seconds  of each unloaded rate, default 10        --minutes  under stress-ng, default 0.5
#include <netinet/in.h>
#include <pthread.h>
#include <sched.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <iterator>
#include <memory>
#include <thread>
#include <vector>

#include "app/device_threads.hpp"
#include "bench/rows.hpp"
#include "egm.pb.h"
#include "rt/counting_allocator.hpp"
#include "weldcell/adapters/egm_udp.hpp"
#include "weldcell/adapters/fd.hpp"
#include "weldcell/adapters/host_clock.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/rt/thread.hpp"

extern char** environ;

namespace weldcell::bench {
namespace {

struct Options {
  bool json = false, stress = true;
  double seconds = 10, stress_minutes = 0.5;
};

double cpu_us(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) * 1e6 + static_cast<double>(t.tv_nsec) * 1e-3;
}

void sleep_until(HostTime t) {
  const timespec at{t.ns / kSecond, t.ns % kSecond};
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr) == EINTR) {
  }
}

sockaddr_in loopback(int port) {
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

constexpr int kFifo = 70;

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
plan::MotionPlan long_motion(double seconds) {
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

/// A controller's frame of RobotWare 6.10's shape: 6 joints, pose, Euler angles, time, states.
class FrameSource {
 public:
  FrameSource() {
    message_.mutable_header()->set_mtype(abb::egm::EgmHeader::MSGTYPE_DATA);
    for (auto* pose : {message_.mutable_feedback()->mutable_cartesian(),
                       message_.mutable_planned()->mutable_cartesian()}) {
      for (auto* p : {pose->mutable_pos()}) p->set_x(945), p->set_y(1), p->set_z(1375);
      auto* q = pose->mutable_orient();
      q->set_u0(0), q->set_u1(1), q->set_u2(0), q->set_u3(0);
      auto* e = pose->mutable_euler();
      e->set_x(180), e->set_y(0), e->set_z(0);
    }
    for (auto* joints :
         {message_.mutable_feedback()->mutable_joints(), message_.mutable_planned()->mutable_joints()}) {
      for (int i = 0; i < 6; ++i) joints->add_joints(i == 4 ? 90 : 0);
    }
    message_.mutable_motorstate()->set_state(abb::egm::EgmMotorState::MOTORS_ON);
    message_.mutable_mcistate()->set_state(abb::egm::EgmMCIState::MCI_RUNNING);
    message_.set_mciconvergencemet(false);
    message_.mutable_testsignals();
    message_.mutable_rapidexecstate()->set_state(abb::egm::EgmRapidCtrlExecState::RAPID_RUNNING);
    message_.set_utilizationrate(12);
  }
  /// The next frame, `step_us` later by the controller's clock, the arm where the last reply sent it.
  const std::string& next(std::int64_t step_us, const abb::egm::EgmSensor& reply) {
    clock_us_ += step_us;
    message_.mutable_header()->set_seqno(seqno_++);
    message_.mutable_header()->set_tm(static_cast<std::uint32_t>(clock_us_ / 1000));
    for (auto* time :
         {message_.mutable_feedback()->mutable_time(), message_.mutable_planned()->mutable_time()}) {
      time->set_sec(static_cast<std::uint64_t>(clock_us_ / 1'000'000));
      time->set_usec(static_cast<std::uint64_t>(clock_us_ % 1'000'000));
    }
    for (int i = 0; i < reply.planned().joints().joints_size(); ++i)
      message_.mutable_feedback()->mutable_joints()->set_joints(i, reply.planned().joints().joints(i));
    message_.SerializeToString(&bytes_);
    return bytes_;
  }

 private:
  abb::egm::EgmRobot message_;
  std::string bytes_;
  std::uint32_t seqno_ = 0;
  std::int64_t clock_us_ = 1'000'000;
};

struct Figures {
  std::vector<double> us;  ///< send to reply
  std::uint64_t sent = 0, late = 0, answered = 0, out_of_order = 0;
  double cpu_us = 0;

  double at(double share) {
    if (us.empty()) return NAN;
    const auto k =
        std::min(us.size() - 1, static_cast<std::size_t>(share * static_cast<double>(us.size() - 1) + 0.5));
    std::nth_element(us.begin(), us.begin() + static_cast<std::ptrdiff_t>(k), us.end());
    return us[k];
  }
  double cpu_per_frame() const { return cpu_us / static_cast<double>(std::max<std::uint64_t>(1, sent)); }
};

/// The controller's socket towards one answerer.
class Line {
 public:
  explicit Line(const Answerer& answerer)
      : fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)), answerer_(&answerer) {
    const sockaddr_in to = loopback(answerer.port);
    if (::connect(fd_.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) std::abort();
    while (!answerer.ready.load(std::memory_order_acquire))
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  /// The size of a reply that came after its deadline; 0 when none waits.
  std::size_t late_reply(std::span<std::byte> reply, Figures& figures) {
    const ssize_t n = ::recv(fd_.get(), reply.data(), reply.size(), MSG_DONTWAIT);
    if (n <= 0) return 0;
    ++figures.late;
    ++figures.answered;
    return static_cast<std::size_t>(n);
  }
  /// Sends and waits for the reply until the deadline; its size, 0 when none came yet.
  std::size_t exchange(const std::string& frame, HostTime deadline, std::span<std::byte> reply,
                       Figures& figures) {
    const HostTime begin = adapters::now();
    if (::send(fd_.get(), frame.data(), frame.size(), 0) < 0) return 0;
    ++figures.sent;
    const Nanoseconds left = std::max<Nanoseconds>(deadline - begin, 1000);
    const timeval limit{left / kSecond, (left % kSecond) / 1000};
    ::setsockopt(fd_.get(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    const ssize_t n = ::recv(fd_.get(), reply.data(), reply.size(), 0);
    const HostTime end = adapters::now();
    if (n <= 0) return 0;
    ++figures.answered;
    figures.us.push_back(static_cast<double>(end - begin) * 1e-3);
    return static_cast<std::size_t>(n);
  }
  double cpu() const { return cpu_us(answerer_->cpu_clock); }

 private:
  adapters::Fd fd_;
  const Answerer* answerer_;
};

struct Pair {
  Figures echo, daemon;
};

class Sender {
 public:
  Sender(Daemon& daemon, const Echo& echo) : daemon_(&daemon), to_daemon_(daemon), to_echo_(echo) {}

  /// Begins the session and its motion.
  void begin() {
    Pair unused;
    run(250, 0.2, unused);
    daemon_->offer();
    run(250, 0.5, unused);
  }

  /// One frame to each in every period, half a period apart.
  void run(double rate_hz, double seconds, Pair& out) {
    const auto period = static_cast<Nanoseconds>(1e9 / rate_hz);
    const auto count = static_cast<std::size_t>(seconds * rate_hz);
    out.daemon.us.reserve(out.daemon.us.size() + count);
    out.echo.us.reserve(out.echo.us.size() + count);
    const double daemon_before = to_daemon_.cpu(), echo_before = to_echo_.cpu();
    HostTime due = adapters::now() + period;
    for (std::size_t k = 0; k < count; ++k, due = due + period) {
      sleep_until(due);
      take_late(out);
      const std::string& frame = frames_.next(period / 1000, reply_);
      const std::size_t n = to_daemon_.exchange(frame, due + period / 2, buffer_, out.daemon);
      if (n > 0) take_reply(n, out.daemon);
      sleep_until(due + period / 2);
      to_echo_.exchange(frame, due + period, buffer_, out.echo);
    }
    sleep_until(adapters::now() + 100 * kMillisecond);
    take_late(out);
    out.daemon.cpu_us += to_daemon_.cpu() - daemon_before;
    out.echo.cpu_us += to_echo_.cpu() - echo_before;
  }

 private:
  /// Replies to frames whose half period was over.
  void take_late(Pair& out) {
    while (const std::size_t n = to_daemon_.late_reply(buffer_, out.daemon)) take_reply(n, out.daemon);
    while (to_echo_.late_reply(buffer_, out.echo) > 0) {
    }
  }

  void take_reply(std::size_t bytes, Figures& figures) {
    if (!reply_.ParseFromArray(buffer_.data(), static_cast<int>(bytes)) ||
        reply_.header().seqno() != expected_) {
      ++figures.out_of_order;
    }
    expected_ = reply_.header().seqno() + 1;
  }

  Daemon* daemon_;
  Line to_daemon_, to_echo_;
  FrameSource frames_;
  abb::egm::EgmSensor reply_;
  std::uint32_t expected_ = 0;
  std::array<std::byte, 2048> buffer_{};
};

/// stress-ng on two CPUs as a child in a group of its own, ended with this object.
class Stress {
 public:
  explicit Stress(double seconds) {
    const std::string limit = std::to_string(static_cast<int>(seconds) + 30) + "s";
    const char* words[] = {"stress-ng", "--cpu", "2", "--quiet", "--timeout", limit.c_str(), nullptr};
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    // Ordinary scheduling: it would inherit ours, which is above what is measured.
    const sched_param ordinary{};
    posix_spawnattr_setschedpolicy(&attributes, SCHED_OTHER);
    posix_spawnattr_setschedparam(&attributes, &ordinary);
    posix_spawnattr_setflags(&attributes,
                             POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSCHEDULER | POSIX_SPAWN_SETSCHEDPARAM);
    if (posix_spawnp(&child_, "stress-ng", nullptr, &attributes, const_cast<char**>(words), environ) != 0)
      child_ = -1;
    posix_spawnattr_destroy(&attributes);
  }
  bool running() const { return child_ > 0 && ::waitpid(child_, nullptr, WNOHANG) == 0; }
  ~Stress() {
    if (child_ <= 0) return;
    ::kill(-child_, SIGTERM);
    ::waitpid(child_, nullptr, 0);
  }

 private:
  pid_t child_ = -1;
};

void add_rows(std::vector<Row>& rows, const std::string& name, Pair& pair, bool judged) {
  const auto row = [&](const char* what, const char* unit, double daemon, double echo, double target) {
    rows.push_back({name + ", " + what, daemon, unit, echo, judged ? target : NAN,
                    judged && !std::isnan(target) ? Better::Lower : Better::None});
  };
  const double echo = pair.echo.at(0.5);
  row("send to reply p50", "us", pair.daemon.at(0.5), echo, echo + 15);
  row("send to reply p99", "us", pair.daemon.at(0.99), pair.echo.at(0.99), NAN);
  row("send to reply p99.9", "us", pair.daemon.at(0.999), pair.echo.at(0.999), NAN);
  row("send to reply max", "us", pair.daemon.at(1), pair.echo.at(1), NAN);
  const double cpu = pair.echo.cpu_per_frame();
  row("CPU per frame", "us", pair.daemon.cpu_per_frame(), cpu, 1.5 * cpu);
  rows.push_back({name + ", frames sent", static_cast<double>(pair.daemon.sent), "", NAN, NAN, Better::None});
  const auto unanswered = [](const Figures& f) { return static_cast<double>(f.sent - f.answered); };
  rows.push_back({name + ", frames unanswered", unanswered(pair.daemon), "", unanswered(pair.echo), 0});
  rows.push_back({name + ", answered after half a cycle", static_cast<double>(pair.daemon.late), "",
                  static_cast<double>(pair.echo.late), NAN, Better::None});
  rows.push_back(
      {name + ", replies out of order", static_cast<double>(pair.daemon.out_of_order), "", NAN, 0});
}

Options options_of(int argc, char** argv) {
  Options out;
  out.json = wants_json(argc, argv);
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--no-stress") out.stress = false;
    if (word == "--seconds" && i + 1 < argc) out.seconds = std::atof(argv[i + 1]);
    if (word == "--minutes" && i + 1 < argc) out.stress_minutes = std::atof(argv[i + 1]);
  }
  return out;
}

int run(const Options& options) {
  auto read = files::read_cell_file(WELDCELL_CONFIG "/cell-demo.yaml");
  if (const auto* faults = std::get_if<files::Faults>(&read)) {
    std::fprintf(stderr, "bench_egm: %s\n", files::text(*faults).c_str());
    return 2;
  }
  const double stress_s = options.stress ? options.stress_minutes * 60 : 0;
  Echo echo;
  Daemon daemon(std::get<files::CellConfig>(read), 2 * options.seconds + stress_s + 60);
  const bool locked = rt::lock_memory().ok();
  // Above both answerers: who measures must not be what is measured.
  sched_param above{};
  above.sched_priority = kFifo + 5;
  const bool fifo =
      pthread_setschedparam(pthread_self(), SCHED_FIFO, &above) == 0 && echo.fifo && daemon.fifo;

  std::vector<Row> rows;
  Sender sender(daemon, echo);
  sender.begin();
  Pair slow, fast, stressed;
  sender.run(250, options.seconds, slow);
  add_rows(rows, "250 Hz", slow, true);
  sender.run(1000, options.seconds, fast);
  add_rows(rows, "1 kHz", fast, true);
  if (options.stress) {
    const Stress stress(stress_s);
    Pair while_it_starts;
    sender.run(250, 1, while_it_starts);
    if (!stress.running()) {
      std::fprintf(stderr, "bench_egm: stress-ng does not run; scripts/install-packages --test\n");
      return 2;
    }
    sender.run(250, stress_s, stressed);
    add_rows(rows, "250 Hz beside stress-ng --cpu 2", stressed, false);
  }
  daemon.end();
  rows.push_back({"allocations of the egm thread", static_cast<double>(daemon.allocations), "", NAN, 0});
  rows.push_back({"references cut by a limit", static_cast<double>(daemon.report().limited), "", NAN, 0});
  rows.push_back({"plan followed to the end (1 = yes)",
                  daemon.report().phase == robot::EgmPhase::Following ? 1.0 : 0.0, "", NAN, 1,
                  Better::Higher});
  rows.push_back({"cycles lost on the way to the cell", static_cast<double>(daemon.dropped()), "", NAN, NAN,
                  Better::None});
  rows.push_back(
      {"FIFO scheduling and locked memory granted", fifo && locked ? 1.0 : 0.0, "", NAN, NAN, Better::None});
  return finish("egm", rows, options.json);
}

}  // namespace
}  // namespace weldcell::bench

int main(int argc, char** argv) { return weldcell::bench::run(weldcell::bench::options_of(argc, argv)); }
