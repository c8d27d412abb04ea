#include "weldcell/wire/egm.hpp"

#include <cmath>

#include "egm.pb.h"

namespace weldcell::wire {
namespace {

using abb::egm::EgmHeader;
using abb::egm::EgmRobot;
using abb::egm::EgmSensor;

constexpr int kAxes = 6;
constexpr std::uint64_t kMaxClockSeconds = (std::uint64_t{1} << 53) / 1'000'000;
constexpr int kMostDoubles = static_cast<int>(kEgmMaxBytes / sizeof(double));

/// Takes what the longest datagram can need, so that no later frame of another shape allocates.
template <typename Message>
Message* warmed(Message* message) {
  message->mutable_unknown_fields()->reserve(kEgmMaxBytes);
  return message;
}

void warm(abb::egm::EgmJoints* joints) { warmed(joints)->mutable_joints()->Reserve(kMostDoubles); }

void warm(abb::egm::EgmPose* pose) {
  warmed(warmed(pose)->mutable_pos());
  warmed(pose->mutable_orient());
  warmed(pose->mutable_euler());
}

/// planned and feedBack have the same fields.
template <typename State>
void warm_state(State* state) {
  warm(warmed(state)->mutable_joints());
  warm(state->mutable_externaljoints());
  warm(state->mutable_cartesian());
  warmed(state->mutable_time());
  warmed(state->mutable_timestamp());
}

void warm(EgmRobot& robot) {
  warmed(warmed(&robot)->mutable_header());
  warm_state(robot.mutable_feedback());
  warm_state(robot.mutable_planned());
  warmed(robot.mutable_motorstate());
  warmed(robot.mutable_mcistate());
  warmed(robot.mutable_rapidexecstate());
  warmed(robot.mutable_testsignals())->mutable_signals()->Reserve(kMostDoubles);
  warmed(robot.mutable_measuredforce())->mutable_force()->Reserve(kMostDoubles);
  warmed(robot.mutable_collisioninfo())->mutable_colldetquota()->Reserve(kMostDoubles);
  warmed(robot.mutable_rapidfromrobot())->mutable_dnum()->Reserve(kMostDoubles);
  warm(robot.mutable_torqueref());
  robot.Clear();
}

void prepare(EgmSensor& sensor) {
  sensor.mutable_header()->set_mtype(EgmHeader::MSGTYPE_CORRECTION);
  sensor.mutable_header()->set_seqno(0);
  sensor.mutable_header()->set_tm(0);
  for (int axis = 0; axis < kAxes; ++axis) {
    sensor.mutable_planned()->mutable_joints()->add_joints(0);
    sensor.mutable_speedref()->mutable_joints()->add_joints(0);
  }
}

template <std::size_t N>
bool all_finite(const std::array<double, N>& values) {
  for (const double value : values) {
    if (!std::isfinite(value)) return false;
  }
  return true;
}

/// Six joints, or nothing.
bool take_joints(const abb::egm::EgmJoints& joints, std::array<double, 6>& out) {
  if (joints.joints_size() != kAxes) return false;
  for (int axis = 0; axis < kAxes; ++axis) out[static_cast<std::size_t>(axis)] = joints.joints(axis);
  return true;
}

bool take_time(const abb::egm::EgmFeedBack& feedback, std::int64_t& time_us) {
  if (!feedback.has_time()) return true;
  if (feedback.time().sec() > kMaxClockSeconds || feedback.time().usec() > kMaxClockSeconds) return false;
  time_us = static_cast<std::int64_t>(feedback.time().sec() * 1'000'000 + feedback.time().usec());
  return true;
}

void take_pose(const abb::egm::EgmPose& pose, EgmFeedback& out) {
  if (pose.has_pos()) out.position_mm = {pose.pos().x(), pose.pos().y(), pose.pos().z()};
  if (pose.has_orient()) {
    out.orientation = {pose.orient().u0(), pose.orient().u1(), pose.orient().u2(), pose.orient().u3()};
  }
}

void take_states(const EgmRobot& robot, EgmFeedback& out) {
  if (robot.has_motorstate()) out.motors = static_cast<MotorState>(robot.motorstate().state());
  if (robot.has_mcistate()) out.mci = static_cast<MciState>(robot.mcistate().state());
  if (robot.has_rapidexecstate()) out.rapid = static_cast<RapidState>(robot.rapidexecstate().state());
  out.converged = robot.mciconvergencemet();
  out.utilization_percent = robot.utilizationrate();
}

EgmDecode take(const EgmRobot& robot, EgmFeedback& out) {
  if (!robot.has_header() || !robot.header().has_seqno() || !robot.header().has_tm())
    return EgmDecode::NoHeader;
  if (robot.header().mtype() != EgmHeader::MSGTYPE_DATA) return EgmDecode::NotData;
  if (!take_joints(robot.feedback().joints(), out.joints_deg)) return EgmDecode::NoJoints;
  out.planned_deg = out.joints_deg;
  const auto& planned = robot.planned().joints();
  if (planned.joints_size() != 0 && !take_joints(planned, out.planned_deg)) return EgmDecode::NoJoints;
  out.seqno = robot.header().seqno();
  out.tm_ms = robot.header().tm();
  if (!take_time(robot.feedback(), out.time_us)) return EgmDecode::NotFinite;
  take_pose(robot.feedback().cartesian(), out);
  take_states(robot, out);
  const bool finite = all_finite(out.joints_deg) && all_finite(out.planned_deg) &&
                      all_finite(out.position_mm) && all_finite(out.orientation) &&
                      std::isfinite(out.utilization_percent);
  return finite ? EgmDecode::Ok : EgmDecode::NotFinite;
}

}  // namespace

const char* to_string(EgmDecode result) {
  switch (result) {
    case EgmDecode::Ok:
      return "ok";
    case EgmDecode::TooLong:
      return "too long";
    case EgmDecode::NotProtobuf:
      return "not an EgmRobot message";
    case EgmDecode::NoHeader:
      return "no header";
    case EgmDecode::NotData:
      return "message type is not DATA";
    case EgmDecode::NoJoints:
      return "not six joints";
    case EgmDecode::NotFinite:
      return "a number is not finite";
  }
  return "unknown";
}

struct EgmCodec::Messages {
  EgmRobot robot;
  EgmSensor sensor;
};

EgmCodec::EgmCodec() : messages_(std::make_unique<Messages>()) {
  warm(messages_->robot);
  prepare(messages_->sensor);
}

EgmCodec::~EgmCodec() = default;

EgmDecode EgmCodec::decode(std::span<const std::byte> datagram, EgmFeedback& out) noexcept {
  if (datagram.size() > kEgmMaxBytes) return EgmDecode::TooLong;
  EgmRobot& robot = messages_->robot;
  // ParseFromArray would write to stderr when a required field is missing; the partial form and the check do
  // not.
  if (!robot.ParsePartialFromArray(datagram.data(), static_cast<int>(datagram.size())) ||
      !robot.IsInitialized()) {
    return EgmDecode::NotProtobuf;
  }
  EgmFeedback taken;
  const EgmDecode result = take(robot, taken);
  if (result == EgmDecode::Ok) out = taken;
  return result;
}

std::size_t EgmCodec::encode(const EgmCommand& command, std::span<std::byte> out) noexcept {
  EgmSensor& sensor = messages_->sensor;
  sensor.mutable_header()->set_seqno(command.seqno);
  sensor.mutable_header()->set_tm(command.tm_ms);
  for (int axis = 0; axis < kAxes; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    sensor.mutable_planned()->mutable_joints()->set_joints(axis, command.joints_deg[i]);
    sensor.mutable_speedref()->mutable_joints()->set_joints(axis, command.speed_deg_s[i]);
  }
  const std::size_t size = sensor.ByteSizeLong();
  if (size > out.size()) return 0;
  sensor.SerializeWithCachedSizesToArray(reinterpret_cast<std::uint8_t*>(out.data()));
  return size;
}

}  // namespace weldcell::wire
