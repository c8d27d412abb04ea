// A scripted controller: makes EgmRobot datagrams frame by frame, gives them to a session and reads the
// replies.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <optional>
#include <string>

#include "egm.pb.h"
#include "weldcell/base/units.hpp"
#include "weldcell/robot/egm_session.hpp"

namespace weldcell::robot {

using Axes = std::array<double, 6>;

inline cell::CellSetup small_cell() {
  cell::CellSetup cell;
  cell.name = "test";
  cell.arm.name = "test";
  for (std::size_t i = 0; i < 6; ++i) {
    cell.arm.lower[i] = rad(-170);
    cell.arm.upper[i] = rad(170);
    cell.arm.max_speed[i] = rad(200);
    cell.limits.joint_acceleration[i] = rad(400);
    cell.limits.joint_jerk[i] = rad(4000);
  }
  cell.limits.joint_speed_fraction = 0.5;
  cell.limits.limit_margin_rad = rad(1);
  return cell;
}

struct Reply {
  std::uint32_t seqno = 0;
  bool correction = false;
  Axes joints{}, speed{};
};

inline std::optional<Reply> read_reply(std::span<const std::byte> bytes) {
  abb::egm::EgmSensor sensor;
  if (!sensor.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return {};
  if (sensor.planned().joints().joints_size() != 6 || sensor.speedref().joints().joints_size() != 6)
    return {};
  Reply out;
  out.seqno = sensor.header().seqno();
  out.correction = sensor.header().mtype() == abb::egm::EgmHeader::MSGTYPE_CORRECTION;
  for (int i = 0; i < 6; ++i) {
    out.joints[static_cast<std::size_t>(i)] = sensor.planned().joints().joints(i);
    out.speed[static_cast<std::size_t>(i)] = sensor.speedref().joints().joints(i);
  }
  return out;
}

/// The controller's side. The simulated arm stands at `joints`; obey() makes it go where the reply says.
class Frames {
 public:
  explicit Frames(EgmSession& session) : session_(session) {}

  std::uint32_t seqno = 0, tm = 5000;
  std::int64_t time_us = 4'995'500;
  bool with_time = true;
  HostTime now{1'000'000'000};
  Axes joints{10, -20, 30, 0, 60, -90};
  wire::MotorState motors = wire::MotorState::On;
  wire::MciState mci = wire::MciState::Running;
  wire::RapidState rapid = wire::RapidState::Running;

  std::string datagram() const {
    abb::egm::EgmRobot robot;
    robot.mutable_header()->set_seqno(seqno);
    robot.mutable_header()->set_tm(tm);
    robot.mutable_header()->set_mtype(abb::egm::EgmHeader::MSGTYPE_DATA);
    for (const double j : joints) robot.mutable_feedback()->mutable_joints()->add_joints(j);
    if (with_time) {
      robot.mutable_feedback()->mutable_time()->set_sec(static_cast<std::uint64_t>(time_us / 1'000'000));
      robot.mutable_feedback()->mutable_time()->set_usec(static_cast<std::uint64_t>(time_us % 1'000'000));
    }
    robot.mutable_motorstate()->set_state(static_cast<abb::egm::EgmMotorState::MotorStateType>(motors));
    robot.mutable_mcistate()->set_state(static_cast<abb::egm::EgmMCIState::MCIStateType>(mci));
    robot.mutable_rapidexecstate()->set_state(
        static_cast<abb::egm::EgmRapidCtrlExecState::RapidCtrlExecStateType>(rapid));
    return robot.SerializeAsString();
  }

  /// Sends the frame as it stands.
  std::optional<Reply> send() {
    const std::string raw = datagram();
    std::array<std::byte, 512> out{};
    const std::size_t n = session_.on_datagram(std::as_bytes(std::span(raw)), now, out);
    if (n == 0) return {};
    auto reply = read_reply(std::span(out).first(n));
    EXPECT_TRUE(reply) << "the reply is no EgmSensor";
    return reply;
  }

  void pass(double ms, std::uint32_t frames = 1) {
    seqno += frames;
    tick_ms_ += ms;
    const auto whole = static_cast<std::uint32_t>(tick_ms_);
    tick_ms_ -= whole;
    tm += whole;
    time_us += std::llround(ms * 1000);
    now = now + std::llround(ms * 1e6);
  }

  /// The next frame, with the arm where the last reply told it to be.
  Reply next(double ms = 4, std::uint32_t frames = 1) {
    pass(ms, frames);
    const auto reply = send();
    if (!reply) {
      ADD_FAILURE() << "no reply";
      return {};
    }
    joints = reply->joints;
    return *reply;
  }

 private:
  EgmSession& session_;
  double tick_ms_ = 0;
};

/// Rest to rest on some axes: q = from + way * (u - sin(2 pi u) / 2 pi).
inline plan::MotionPlan smooth_plan(std::uint64_t id, const Axes& from_deg, const Axes& way_deg,
                                    double duration_s, double period_s = 0.004) {
  plan::MotionPlan plan;
  plan.id = id;
  plan.period_s = period_s;
  const auto count = static_cast<std::size_t>(std::lround(duration_s / period_s));
  for (std::size_t k = 0; k <= count; ++k) {
    const double u = static_cast<double>(k) / static_cast<double>(count), w = 2 * kPi;
    plan::MotionSample sample;
    for (std::size_t i = 0; i < 6; ++i) {
      sample.q[i] = rad(from_deg[i] + way_deg[i] * (u - std::sin(w * u) / w));
      sample.qd[i] = rad(way_deg[i] * (1 - std::cos(w * u)) / (period_s * static_cast<double>(count)));
    }
    plan.samples.push_back(sample);
  }
  return plan;
}

}  // namespace weldcell::robot
