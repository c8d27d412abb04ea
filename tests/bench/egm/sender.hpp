// The controller's side of this bench: frames to both answerers in turn, and what came back when.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "bench/egm/answerers.hpp"
#include "egm.pb.h"
#include "weldcell/adapters/host_clock.hpp"

namespace weldcell::bench {

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

}  // namespace weldcell::bench
