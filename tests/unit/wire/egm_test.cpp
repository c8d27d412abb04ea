#include "weldcell/wire/egm.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "egm.pb.h"
#include "unit/wire/egm_golden.hpp"

namespace weldcell::wire {
namespace {

using golden::bytes;

constexpr std::array<double, 6> kMeasured{0, -20.5, 10.25, 0, 60, -180};
constexpr std::array<double, 6> kPlanned{0.125, -20, 10.5, 0, 60.5, -180};

abb::egm::EgmRobot message(const char* hex) {
  abb::egm::EgmRobot robot;
  const auto raw = bytes(hex);
  EXPECT_TRUE(robot.ParseFromArray(raw.data(), static_cast<int>(raw.size())));
  return robot;
}

EgmDecode decode(const abb::egm::EgmRobot& robot) {
  const std::string raw = robot.SerializePartialAsString();
  EgmCodec codec;
  EgmFeedback out;
  return codec.decode(std::as_bytes(std::span(raw)), out);
}

TEST(EgmDecode, RobotWare6Frame) {
  EgmCodec codec;
  EgmFeedback f;
  ASSERT_EQ(codec.decode(bytes(golden::kRw6Hex), f), EgmDecode::Ok);
  EXPECT_EQ(f.seqno, 352216U);
  EXPECT_EQ(f.tm_ms, 28397221U);
  EXPECT_EQ(f.joints_deg, kMeasured);
  EXPECT_EQ(f.planned_deg, kPlanned);
  EXPECT_EQ(f.time_us, 28397216500);
  EXPECT_EQ(f.position_mm, (std::array<double, 3>{1084.5, 0, 1245.25}));
  EXPECT_EQ(f.orientation, (std::array<double, 4>{0.5, 0.5, -0.5, 0.5}));
  EXPECT_EQ(f.motors, MotorState::On);
  EXPECT_EQ(f.mci, MciState::Running);
  EXPECT_EQ(f.rapid, RapidState::Running);
  EXPECT_FALSE(f.converged);
  EXPECT_EQ(f.utilization_percent, 12.5);
}

TEST(EgmDecode, RobotWare7FrameWithExternalsAndEveryOptionalField) {
  EgmCodec codec;
  EgmFeedback f;
  ASSERT_EQ(codec.decode(bytes(golden::kRw7Hex), f), EgmDecode::Ok);
  EXPECT_EQ(f.seqno, 0U);
  EXPECT_EQ(f.joints_deg, kMeasured);
  EXPECT_EQ(f.planned_deg, kPlanned);
  EXPECT_EQ(f.time_us, 28397216500);
  EXPECT_EQ(f.rapid, RapidState::Undefined);
  EXPECT_TRUE(f.converged);
  EXPECT_EQ(f.utilization_percent, 99.75);
}

TEST(EgmDecode, PackedDoublesWithoutPlannedAndTime) {
  EgmCodec codec;
  EgmFeedback f;
  ASSERT_EQ(codec.decode(bytes(golden::kPackedHex), f), EgmDecode::Ok);
  EXPECT_EQ(f.seqno, 7U);
  EXPECT_EQ(f.tm_ms, std::numeric_limits<std::uint32_t>::max());
  EXPECT_EQ(f.joints_deg, kMeasured);
  EXPECT_EQ(f.planned_deg, kMeasured);
  EXPECT_EQ(f.time_us, -1);
  EXPECT_EQ(f.position_mm, (std::array<double, 3>{}));
  EXPECT_EQ(f.motors, MotorState::Off);
  EXPECT_EQ(f.mci, MciState::Stopped);
  EXPECT_EQ(f.rapid, RapidState::Stopped);
}

TEST(EgmDecode, FrameOfOneShapeLeavesNothingBehindInTheNext) {
  EgmCodec codec;
  EgmFeedback f;
  ASSERT_EQ(codec.decode(bytes(golden::kRw7Hex), f), EgmDecode::Ok);
  ASSERT_EQ(codec.decode(bytes(golden::kPackedHex), f), EgmDecode::Ok);
  EXPECT_EQ(f.planned_deg, kMeasured);
  EXPECT_EQ(f.time_us, -1);
  EXPECT_FALSE(f.converged);
}

TEST(EgmDecode, RefusesWhatIsNoFrameAndLeavesTheOutputAlone) {
  EgmCodec codec;
  EgmFeedback f;
  f.seqno = 77;
  const std::vector<std::byte> noise(200, std::byte{0xFF});
  EXPECT_EQ(codec.decode(noise, f), EgmDecode::NotProtobuf);
  EXPECT_EQ(codec.decode({}, f), EgmDecode::NoHeader);
  EXPECT_EQ(codec.decode(bytes(golden::kSensorHex), f), EgmDecode::NotData);
  EXPECT_EQ(codec.decode(std::vector<std::byte>(kEgmMaxBytes + 1), f), EgmDecode::TooLong);
  EXPECT_EQ(f.seqno, 77U);
}

TEST(EgmDecode, RefusesEveryTruncation) {
  EgmCodec codec;
  const auto whole = bytes(golden::kRw6Hex);
  // Cut after the planned message the frame still says all that is needed; before it, it must be refused.
  const std::size_t needed = bytes("0a0b08d8bf1510a59dc50d1802").size() + 169;
  for (std::size_t n = 0; n < needed; ++n) {
    EgmFeedback f;
    EXPECT_NE(codec.decode(std::span(whole).first(n), f), EgmDecode::Ok) << n << " bytes";
  }
  EgmFeedback f;
  EXPECT_EQ(codec.decode(std::span(whole).first(needed), f), EgmDecode::Ok);
}

TEST(EgmDecode, HeaderFieldsAreRequired) {
  auto robot = message(golden::kRw6Hex);
  robot.mutable_header()->clear_seqno();
  EXPECT_EQ(decode(robot), EgmDecode::NoHeader);
  robot = message(golden::kRw6Hex);
  robot.mutable_header()->clear_tm();
  EXPECT_EQ(decode(robot), EgmDecode::NoHeader);
  robot = message(golden::kRw6Hex);
  robot.mutable_header()->clear_mtype();
  EXPECT_EQ(decode(robot), EgmDecode::NotData);
  robot.mutable_header()->set_mtype(abb::egm::EgmHeader::MSGTYPE_COMMAND);
  EXPECT_EQ(decode(robot), EgmDecode::NotData);
}

TEST(EgmDecode, MissingRequiredFieldIsRefusedInSilence) {
  auto robot = message(golden::kRw6Hex);
  robot.mutable_mcistate()->clear_state();
  testing::internal::CaptureStderr();
  EXPECT_EQ(decode(robot), EgmDecode::NotProtobuf);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(EgmDecode, AbsentStatesAreUndefined) {
  auto robot = message(golden::kRw6Hex);
  robot.clear_motorstate();
  robot.clear_mcistate();
  robot.clear_rapidexecstate();
  const std::string raw = robot.SerializeAsString();
  EgmCodec codec;
  EgmFeedback f;
  ASSERT_EQ(codec.decode(std::as_bytes(std::span(raw)), f), EgmDecode::Ok);
  EXPECT_EQ(f.motors, MotorState::Undefined);
  EXPECT_EQ(f.mci, MciState::Undefined);
  EXPECT_EQ(f.rapid, RapidState::Undefined);
}

TEST(EgmDecode, JointsMustBeSix) {
  auto robot = message(golden::kRw6Hex);
  robot.mutable_feedback()->mutable_joints()->add_joints(1);
  EXPECT_EQ(decode(robot), EgmDecode::NoJoints);
  robot = message(golden::kRw6Hex);
  robot.mutable_feedback()->clear_joints();
  EXPECT_EQ(decode(robot), EgmDecode::NoJoints);
  robot = message(golden::kRw6Hex);
  robot.mutable_planned()->mutable_joints()->mutable_joints()->Truncate(5);
  EXPECT_EQ(decode(robot), EgmDecode::NoJoints);
  robot = message(golden::kRw6Hex);
  robot.mutable_planned()->clear_joints();
  EXPECT_EQ(decode(robot), EgmDecode::Ok);
}

TEST(EgmDecode, NumbersMustBeFinite) {
  for (const double bad :
       {std::nan(""), std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()}) {
    auto robot = message(golden::kRw6Hex);
    robot.mutable_feedback()->mutable_joints()->set_joints(3, bad);
    EXPECT_EQ(decode(robot), EgmDecode::NotFinite);
    robot = message(golden::kRw6Hex);
    robot.mutable_planned()->mutable_joints()->set_joints(5, bad);
    EXPECT_EQ(decode(robot), EgmDecode::NotFinite);
    robot = message(golden::kRw6Hex);
    robot.mutable_feedback()->mutable_cartesian()->mutable_pos()->set_y(bad);
    EXPECT_EQ(decode(robot), EgmDecode::NotFinite);
    robot = message(golden::kRw6Hex);
    robot.mutable_feedback()->mutable_cartesian()->mutable_orient()->set_u3(bad);
    EXPECT_EQ(decode(robot), EgmDecode::NotFinite);
    robot = message(golden::kRw6Hex);
    robot.set_utilizationrate(bad);
    EXPECT_EQ(decode(robot), EgmDecode::NotFinite);
  }
  auto robot = message(golden::kRw6Hex);
  robot.mutable_feedback()->mutable_time()->set_sec(std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(decode(robot), EgmDecode::NotFinite);
}

TEST(EgmEncode, GoldenReplyBytes) {
  EgmCodec codec;
  std::array<std::byte, kEgmMaxBytes> out{};
  const auto expected = bytes(golden::kSensorHex);
  const EgmCommand command{5, 28397221, kMeasured, {1.5, -2.5, 0, 0, 0, 30}};
  for (int again = 0; again < 2; ++again) {
    const std::size_t n = codec.encode(command, out);
    ASSERT_EQ(n, expected.size());
    EXPECT_TRUE(std::equal(expected.begin(), expected.end(), out.begin()));
  }
}

TEST(EgmEncode, AnswersZeroWhenTheReplyDoesNotFit) {
  EgmCodec codec;
  std::array<std::byte, kEgmMaxBytes> out{};
  const std::size_t need = bytes(golden::kSensorHex).size();
  const EgmCommand command{5, 28397221, kMeasured, {}};
  EXPECT_EQ(codec.encode(command, std::span(out).first(need - 1)), 0U);
  EXPECT_EQ(codec.encode(command, std::span(out).first(need)), need);
}

}  // namespace
}  // namespace weldcell::wire
