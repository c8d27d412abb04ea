// EgmRobot frames of RobotWare 6.07 to 7.16 as bytes, put together here field by field without protobuf:
// every shape, with packed and unpacked doubles, with and without external axes, with the measured force in
// either numbering.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <string>

#include "unit/wire/egm_golden.hpp"
#include "weldcell/wire/egm.hpp"

namespace weldcell::wire {
namespace {

constexpr std::array<double, 6> kMeasured{0, -20.5, 10.25, 0, 60, -180};
constexpr std::array<double, 6> kPlanned{0.125, -20, 10.5, 0, 60.5, -180};

std::string varint(std::uint64_t value) {
  std::string out;
  for (; value > 127; value >>= 7) out += static_cast<char>(value | 128);
  return out + static_cast<char>(value);
}
std::string number(int field, std::uint64_t value) {
  return varint(static_cast<unsigned>(field) << 3) + varint(value);
}
std::string real(int field, double value) {
  std::string out = varint(static_cast<unsigned>(field) << 3 | 1);
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  return out.append(raw, sizeof raw);
}
std::string inside(int field, const std::string& content) {
  return varint(static_cast<unsigned>(field) << 3 | 2) + varint(content.size()) + content;
}
template <typename Values>
std::string reals(int field, const Values& values, bool packed) {
  std::string out;
  for (const double value : values) out += packed ? real(field, value).substr(1) : real(field, value);
  return packed ? inside(field, out) : out;
}

struct Shape {
  int robotware;
  bool packed;
  int externals;  ///< -1: not even an empty list
  bool force;
};

std::string state_of(const std::array<double, 6>& joints, unsigned time_us, const Shape& shape) {
  std::string pose = inside(1, real(1, 1084.5) + real(2, 0) + real(3, 1245.25)) +
                     inside(2, real(1, 0.5) + real(2, 0.5) + real(3, -0.5) + real(4, 0.5)) +
                     inside(3, real(1, 0) + real(2, 90) + real(3, 0));
  std::string out = inside(1, reals(1, joints, shape.packed)) + inside(2, pose);
  const std::vector<double> externals(static_cast<std::size_t>(std::max(0, shape.externals)), 7.5);
  if (shape.externals >= 0)
    out += inside(3, shape.externals > 0 ? reals(1, externals, shape.packed) : std::string());
  out += inside(4, number(1, 28397) + number(2, time_us));
  if (shape.robotware >= 716) out += inside(5, number(1, 28397) + number(2, 216500123));
  return out;
}

std::string frame_of(const Shape& shape) {
  const std::array<double, 6> six{1, 2, 3, 4, 5, 6};
  std::string out = inside(1, number(1, 352216) + number(2, 28397221) + number(3, 2));
  out += inside(2, state_of(kMeasured, 216500, shape)) + inside(3, state_of(kPlanned, 236500, shape));
  out += inside(4, number(1, 1)) + inside(5, number(1, 3)) + number(6, 0) + inside(7, "") +
         inside(8, number(1, 2));
  if (shape.force && shape.robotware < 700) out += inside(9, reals(1, six, shape.packed));
  if (shape.force && shape.robotware >= 700) out += inside(9, number(1, 0) + reals(2, six, shape.packed));
  if (shape.robotware >= 610) out += real(10, 12.5);
  if (shape.robotware >= 706) out += number(11, 3) + inside(12, number(1, 0) + reals(2, six, shape.packed));
  if (shape.robotware >= 707) out += inside(13, number(1, 1) + reals(2, six, shape.packed));
  if (shape.robotware >= 716) out += inside(14, reals(1, six, shape.packed));
  return out;
}

TEST(EgmShapes, TheByteEncoderOfThisTestAgreesWithTheGoldenFrame) {
  const auto golden = golden::bytes(golden::kRw6Hex);
  // The golden frame of RobotWare 6.10 has three force components where this encoder writes six.
  std::string own = frame_of({610, false, 0, false});
  const std::string force = inside(9, reals(1, std::array<double, 3>{1, 2, 3}, false));
  own.insert(own.size() - real(10, 12.5).size(), force);
  ASSERT_EQ(own.size(), golden.size());
  EXPECT_EQ(std::memcmp(own.data(), golden.data(), own.size()), 0);
}

TEST(EgmShapes, EveryRobotWareFrom607To716IsRead) {
  EgmCodec codec;
  int read = 0;
  for (const int robotware : {607, 610, 700, 706, 707, 716}) {
    for (const bool packed : {false, true}) {
      for (const int externals : {-1, 0, 1, 3, 6}) {
        for (const bool force : {false, true}) {
          const std::string raw = frame_of({robotware, packed, externals, force});
          EgmFeedback f;
          const auto what = ::testing::Message() << robotware << (packed ? " packed, " : " unpacked, ")
                                                 << externals << " externals" << (force ? ", force" : "");
          ASSERT_EQ(codec.decode(std::as_bytes(std::span(raw)), f), EgmDecode::Ok) << what;
          EXPECT_EQ(f.seqno, 352216U) << what;
          EXPECT_EQ(f.tm_ms, 28397221U) << what;
          EXPECT_EQ(f.joints_deg, kMeasured) << what;
          EXPECT_EQ(f.planned_deg, kPlanned) << what;
          EXPECT_EQ(f.time_us, 28397216500) << what;
          EXPECT_EQ(f.position_mm, (std::array<double, 3>{1084.5, 0, 1245.25})) << what;
          EXPECT_EQ(f.orientation, (std::array<double, 4>{0.5, 0.5, -0.5, 0.5})) << what;
          EXPECT_EQ(f.motors, MotorState::On) << what;
          EXPECT_EQ(f.mci, MciState::Running) << what;
          EXPECT_EQ(f.rapid, RapidState::Running) << what;
          EXPECT_EQ(f.utilization_percent, robotware >= 610 ? 12.5 : 0) << what;
          ++read;
        }
      }
    }
  }
  EXPECT_EQ(read, 120);
}

TEST(EgmShapes, ForceOfTheOtherGenerationIsNoFault) {
  // A frame of RobotWare 7 with the doubles where RobotWare 6 has them, and the other way round.
  EgmCodec codec;
  EgmFeedback f;
  const std::array<double, 6> six{1, 2, 3, 4, 5, 6};
  for (const bool packed : {false, true}) {
    const std::string seven = frame_of({716, false, 0, false}) + inside(9, reals(1, six, packed));
    EXPECT_EQ(codec.decode(std::as_bytes(std::span(seven)), f), EgmDecode::Ok);
    const std::string six_point_ten =
        frame_of({610, false, 0, false}) + inside(9, number(1, 1) + reals(2, six, packed));
    EXPECT_EQ(codec.decode(std::as_bytes(std::span(six_point_ten)), f), EgmDecode::Ok);
  }
}

}  // namespace
}  // namespace weldcell::wire
