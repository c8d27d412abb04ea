#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "unit/kinematics/robots.hpp"

namespace weldcell::kinematics {
namespace {

constexpr std::uint64_t kSeed = 26001;

std::string text(const Joints& q) {
  std::string out;
  for (double a : q) out += std::to_string(deg(a)) + " ";
  return out;
}

Joints random_joints(const ArmModel& arm, std::mt19937_64& random) {
  Joints q{};
  for (std::size_t i = 0; i < 6; ++i)
    q[i] = std::uniform_real_distribution<double>(arm.lower[i], arm.upper[i])(random);
  return q;
}

double pose_error(const Transform<Base, Flange>& a, const Transform<Base, Flange>& b) {
  return (a.position_mm() - b.position_mm()).norm() / 1000 + (a.rotation() - b.rotation()).norm();
}

class EveryArm : public ::testing::TestWithParam<testing::ArmRow> {};

TEST_P(EveryArm, InverseContainsTheJointsAndEverySolutionGivesThePose) {
  const ArmModel arm = testing::arm_from(GetParam());
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  std::mt19937_64 random(kSeed);
  std::size_t solutions = 0, turned = 0;
  for (int n = 0; n < 10000; ++n) {
    const Joints q = random_joints(arm, random);
    const Transform<Base, Flange> pose = forward(arm, q);
    bool contained = false;
    for (const Joints& s : inverse(arm, pose, q)) {
      ++solutions;
      ASSERT_TRUE(within_limits(arm, s, -1e-12)) << text(s);
      ASSERT_LT(pose_error(forward(arm, s), pose), 1e-9) << text(q) << " -> " << text(s);
      double worst = 0;
      for (std::size_t i = 0; i < 6; ++i) worst = std::max(worst, std::abs(s[i] - q[i]));
      contained = contained || worst < 1e-6;
      turned += std::abs(s[5]) > kPi;
    }
    ASSERT_TRUE(contained) << arm.name << ": " << text(q);
  }
  EXPECT_GT(solutions, 20000u);
  EXPECT_GT(turned, 1000u) << "turns of J6 beyond 180 deg were never offered";
}

TEST_P(EveryArm, BranchSlotsAreTheBranchNumbers) {
  const ArmModel arm = testing::arm_from(GetParam());
  std::mt19937_64 random(kSeed + 1);
  int all_eight = 0;
  for (int n = 0; n < 2000; ++n) {
    const Joints q = random_joints(arm, random);
    Branches branches;
    inverse_branches(arm, forward(arm, q), q, branches);
    int valid = 0;
    for (std::size_t slot = 0; slot < Branches::kCount; ++slot) {
      if (!branches.valid[slot]) continue;
      ++valid;
      ASSERT_EQ(branch_of(arm, branches.joints[slot]), static_cast<int>(slot)) << text(q);
    }
    all_eight += valid == 8;
  }
  EXPECT_GT(all_eight, 1000);
}

TEST_P(EveryArm, JacobianIsTheDerivative) {
  const ArmModel arm = testing::arm_from(GetParam());
  std::mt19937_64 random(kSeed + 2);
  constexpr double kStep = 1e-6;
  for (int n = 0; n < 200; ++n) {
    const Joints q = random_joints(arm, random);
    const Eigen::Matrix<double, 6, 6> j = jacobian(arm, q);
    const Eigen::Matrix3d r = forward(arm, q).rotation();
    for (int i = 0; i < 6; ++i) {
      Joints low = q, high = q;
      low[static_cast<std::size_t>(i)] -= kStep, high[static_cast<std::size_t>(i)] += kStep;
      const Transform<Base, Flange> a = forward(arm, low), b = forward(arm, high);
      const Eigen::Vector3d v = (b.position_mm() - a.position_mm()) / (2 * kStep);
      const Eigen::Matrix3d s = (b.rotation() - a.rotation()) / (2 * kStep) * r.transpose();
      ASSERT_LT((v - j.block<3, 1>(0, i)).norm(), 1e-3) << text(q);
      ASSERT_LT((Eigen::Vector3d(s(2, 1), s(0, 2), s(1, 0)) - j.block<3, 1>(3, i)).norm(), 1e-6) << text(q);
    }
  }
}

TEST_P(EveryArm, SingularWristKeepsJ4) {
  const ArmModel arm = testing::arm_from(GetParam());
  std::mt19937_64 random(kSeed + 3);
  for (int n = 0; n < 1000; ++n) {
    Joints q = random_joints(arm, random);
    for (const double j5 : {0.0, 1e-9, -1e-12, 1e-5}) {
      q[4] = j5;
      const Transform<Base, Flange> pose = forward(arm, q);
      Joints found{};
      ASSERT_TRUE(inverse_near(arm, pose, q, 0, 1e-3, found) || j5 < 0) << text(q);
      const std::vector<Joints> all = inverse(arm, pose, q);
      ASSERT_FALSE(all.empty());
      EXPECT_NEAR(all.front()[3], q[3], 1e-5) << text(q);
      EXPECT_NEAR(all.front()[5], q[5], 1e-5) << text(q);
      EXPECT_LT(pose_error(forward(arm, all.front()), pose), 1e-6);
    }
  }
}

TEST_P(EveryArm, StretchedElbowIsStillReached) {
  const ArmModel arm = testing::arm_from(GetParam());
  // The elbow is stretched where c3 and a2 line up with the lower arm.
  Joints q{0.3, 0.2, std::atan2(-arm.a2, arm.c3) - kPi / 2, 0.4, 0.5, 0.6};
  if (!within_limits(arm, q)) GTEST_SKIP() << "not within the limits of " << arm.name;
  const Transform<Base, Flange> pose = forward(arm, q);
  const std::vector<Joints> all = inverse(arm, pose, q);
  ASSERT_FALSE(all.empty());
  EXPECT_LT(pose_error(forward(arm, all.front()), pose), 1e-7);
  Transform<Base, Flange> beyond = pose;
  beyond.iso.translation() *= 1.5;
  EXPECT_TRUE(inverse(arm, beyond, q).empty());
}

INSTANTIATE_TEST_SUITE_P(Arms, EveryArm, ::testing::ValuesIn(testing::kReferenceArms),
                         [](const auto& instance) { return std::string(instance.param.name); });

TEST(Inverse, OffersTurnsAndRegardsTheMargin) {
  const ArmModel arm = testing::irb2600_185();
  const Joints q{0, rad(20), rad(10), rad(30), rad(60), rad(-350)};
  const Transform<Base, Flange> pose = forward(arm, q);
  int turns = 0;
  for (const Joints& s : inverse(arm, pose, q)) {
    turns += std::abs(s[4] - q[4]) < 1e-9 && std::abs(s[0] - q[0]) < 1e-9 && std::abs(s[1] - q[1]) < 1e-9;
  }
  EXPECT_EQ(turns, 3 * 3);  // J4: -330, 30, 390; J6: -350, 10, 370
  turns = 0;
  for (const Joints& s : inverse(arm, pose, q, rad(15))) {
    turns += std::abs(s[4] - q[4]) < 1e-9 && std::abs(s[0] - q[0]) < 1e-9 && std::abs(s[1] - q[1]) < 1e-9;
  }
  EXPECT_EQ(turns, 2 * 3);  // J4 = 390 is closer than 15 deg to its limit
}

TEST(InverseNear, FollowsAPathWithoutFlips) {
  const ArmModel arm = testing::irb2600_185();
  const Joints start{rad(-20), rad(10), rad(5), rad(15), rad(70), rad(100)};
  Transform<Base, Flange> pose = forward(arm, start);
  Joints q = start;
  for (int n = 0; n < 400; ++n) {
    pose.iso.translation().y() += 1;
    pose.iso.linear() =
        Eigen::AngleAxisd(rad(0.5), Eigen::Vector3d::UnitZ()).toRotationMatrix() * pose.iso.linear();
    Joints next{};
    ASSERT_TRUE(inverse_near(arm, pose, q, 0.0175, 0.1, next)) << n << ": " << text(q);
    ASSERT_EQ(branch_of(arm, next), branch_of(arm, start));
    q = next;
  }
  EXPECT_LT(q[5], rad(-60)) << "J6 had to turn by about -200 deg";
  Joints far{};
  pose.iso.translation().z() += 100;
  EXPECT_FALSE(inverse_near(arm, pose, q, 0, 0.01, far)) << "100 mm is more than 0.01 rad";
}

TEST(Inverse, KnowsNoSolutionForWhatIsNoPose) {
  const ArmModel arm = testing::irb2600_185();
  const Joints start{rad(-20), rad(10), rad(5), rad(15), rad(70), rad(100)};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      Transform<Base, Flange> pose = forward(arm, start);
      pose.iso.matrix()(row, column) = std::nan("");
      Joints out{};
      EXPECT_TRUE(inverse(arm, pose, start).empty()) << row << column;
      EXPECT_FALSE(inverse_near(arm, pose, start, 0, 10, out)) << row << column;
    }
  }
}

TEST(Coupling, TurnsTheUpperArmWithTheLinkage) {
  ArmModel arm = testing::irb2600_185();
  const Joints serial{0.1, 0.2, -0.3, 0.4, 0.5, 0.6};
  const Transform<Base, Flange> pose = forward(arm, serial);
  arm.j3_j2_coupling = 1;
  Joints linked = serial;
  linked[2] += linked[1];
  EXPECT_LT(pose_error(forward(arm, linked), pose), 1e-12);
  const std::vector<Joints> found = inverse(arm, pose, linked);
  ASSERT_FALSE(found.empty());
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(found.front()[i], linked[i], 1e-9);
  EXPECT_EQ(configuration(arm, linked).cfx, 0);

  constexpr double kStep = 1e-6;
  Joints low = linked, high = linked;
  low[1] -= kStep, high[1] += kStep;
  const Eigen::Vector3d v =
      (forward(arm, high).position_mm() - forward(arm, low).position_mm()) / (2 * kStep);
  EXPECT_LT((v - jacobian(arm, linked).block<3, 1>(0, 1)).norm(), 1e-3);
}

TEST(OppositeSigns, AreTheMirroredArm) {
  ArmModel arm = testing::irb2600_185();
  arm.sign = {-1, 1, -1, 1, -1, 1};
  arm.b = 40;
  std::mt19937_64 random(kSeed + 4);
  for (int n = 0; n < 1000; ++n) {
    Joints q{};
    for (std::size_t i = 0; i < 6; ++i) q[i] = std::uniform_real_distribution<double>(-1.2, 1.2)(random);
    arm.lower.fill(-3.1), arm.upper.fill(3.1);
    const Transform<Base, Flange> pose = forward(arm, q);
    const std::vector<Joints> found = inverse(arm, pose, q);
    ASSERT_FALSE(found.empty()) << text(q);
    for (std::size_t i = 0; i < 6; ++i) ASSERT_NEAR(found.front()[i], q[i], 1e-6) << text(q);
  }
}

TEST(Dexterity, FallsToZeroAtLimitsAndSingularities) {
  const ArmModel arm = testing::irb2600_185();
  const Joints good{0, 0, 0, 0, rad(90), 0};
  EXPECT_GT(dexterity(arm, good), 0.24);
  Joints q = good;
  q[4] = 0;
  EXPECT_NEAR(dexterity(arm, q), 0, 1e-12);
  q = good;
  q[2] = arm.upper[2];
  EXPECT_NEAR(dexterity(arm, q), 0, 1e-12);
  q[2] = arm.upper[2] + 0.1;
  EXPECT_LT(dexterity(arm, q), 0);
  q = good;
  q[2] = rad(-81.7689);  // elbow singularity of the 2600: -atan(c3 / |a2|)
  EXPECT_LT(dexterity(arm, q), 1e-5);
}

}  // namespace
}  // namespace weldcell::kinematics
