#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "unit/plan/demo_cell.hpp"
#include "weldcell/plan/motion_plan.hpp"

namespace weldcell::plan {
namespace {

constexpr std::uint64_t kSeed = 2718;

kinematics::Joints random_joints(const cell::CellSetup& cell, std::mt19937_64& random) {
  kinematics::Joints q{};
  for (std::size_t i = 0; i < 6; ++i) {
    const double margin = cell.limits.limit_margin_rad;
    q[i] = std::uniform_real_distribution<double>(cell.arm.lower[i] + margin,
                                                  cell.arm.upper[i] - margin)(random);
  }
  return q;
}

TEST(JointMove, ThousandsOfRandomMovesPassThePreflight) {
  const cell::CellSetup cell = testing::demo_cell();
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  std::mt19937_64 random(kSeed);
  for (int n = 0; n < 2000; ++n) {
    const kinematics::Joints from = random_joints(cell, random);
    kinematics::Joints to = random_joints(cell, random);
    const double share = std::pow(10, std::uniform_real_distribution<double>(-4, 0)(random));
    for (std::size_t i = 0; i < 6; ++i) to[i] = from[i] + share * (to[i] - from[i]);
    const Result<MotionPlan> plan = joint_move(cell, from, to);
    ASSERT_TRUE(plan.ok()) << n << ": " << plan.error().text();
    EXPECT_EQ(plan->samples.front().q, from);
    EXPECT_EQ(plan->samples.back().q, to);
    // All axes in step: each has done the same share of its way.
    const MotionSample middle = sample_at(*plan, plan->duration_s() / 3);
    const double done = (middle.q[0] - from[0]) / (to[0] - from[0]);
    for (std::size_t i = 1; i < 6; ++i) EXPECT_NEAR((middle.q[i] - from[i]) / (to[i] - from[i]), done, 1e-6);
  }
}

TEST(JointMove, UsesTheLimitOfTheSlowestAxis) {
  const cell::CellSetup cell = testing::demo_cell();
  kinematics::Joints to = cell.home;
  to[0] += rad(120);
  const Result<MotionPlan> plan = joint_move(cell, cell.home, to);
  ASSERT_TRUE(plan.ok());
  double fastest = 0;
  for (const MotionSample& s : plan->samples) fastest = std::max(fastest, s.qd[0]);
  EXPECT_NEAR(fastest, cell.arm.max_speed[0] * cell.limits.joint_speed_fraction, 1e-6);
}

TEST(JointMove, OfNoLengthHoldsStill) {
  const cell::CellSetup cell = testing::demo_cell();
  const Result<MotionPlan> plan = joint_move(cell, cell.home, cell.home);
  ASSERT_TRUE(plan.ok());
  EXPECT_EQ(plan->duration_s(), 0);
  EXPECT_EQ(sample_at(*plan, 1).q, cell.home);
}

TEST(JointMove, RefusesATargetBeyondTheMargin) {
  const cell::CellSetup cell = testing::demo_cell();
  kinematics::Joints to = cell.home;
  to[4] = cell.arm.upper[4] - 0.5 * cell.limits.limit_margin_rad;
  const Result<MotionPlan> plan = joint_move(cell, cell.home, to);
  ASSERT_FALSE(plan.ok());
  EXPECT_EQ(plan.error().code, "plan.limit");
  EXPECT_NE(plan.error().text().find("J5"), std::string::npos) << plan.error().text();
}

TEST(JointMove, RefusesACellWithoutLimits) {
  cell::CellSetup cell = testing::demo_cell();
  cell.limits.joint_jerk[3] = 0;
  const Result<MotionPlan> plan = joint_move(cell, cell.home, cell.home);
  ASSERT_FALSE(plan.ok());
  EXPECT_EQ(plan.error().code, "plan.limits");
}

TEST(SampleAt, InterpolatesCubicallyAndClamps) {
  const cell::CellSetup cell = testing::demo_cell();
  kinematics::Joints to = cell.home;
  to[2] -= rad(60), to[5] += rad(100);
  const Result<MotionPlan> plan = joint_move(cell, cell.home, to);
  ASSERT_TRUE(plan.ok());
  EXPECT_EQ(sample_at(*plan, -1).q, cell.home);
  EXPECT_EQ(sample_at(*plan, 1e9).q, to);
  EXPECT_EQ(sample_at(MotionPlan{}, 0.5).q, kinematics::Joints{});
  for (std::size_t k = 0; k < plan->samples.size(); k += 7) {
    const MotionSample s = sample_at(*plan, plan->period_s * static_cast<double>(k));
    for (std::size_t i = 0; i < 6; ++i) {
      EXPECT_NEAR(s.q[i], plan->samples[k].q[i], 1e-9);
      EXPECT_NEAR(s.qd[i], plan->samples[k].qd[i], 1e-6);
    }
  }
  for (double t = 0.001; t + 0.001 < plan->duration_s(); t += 0.00317) {
    const MotionSample a = sample_at(*plan, t - 1e-6), b = sample_at(*plan, t + 1e-6),
                       m = sample_at(*plan, t);
    EXPECT_NEAR((b.q[5] - a.q[5]) / 2e-6, m.qd[5], 1e-4);
  }
}

class Spoiled : public ::testing::Test {
 protected:
  void SetUp() override {
    kinematics::Joints to = cell_.home;
    to[0] += rad(40), to[3] += rad(20);
    plan_ = joint_move(cell_, cell_.home, to).value();
    ASSERT_TRUE(preflight(cell_, plan_).ok());
  }
  void refuses(const char* code, const char* axis) {
    const Status status = preflight(cell_, plan_);
    ASSERT_FALSE(status.ok()) << code;
    EXPECT_EQ(status.error().code, code) << status.error().text();
    EXPECT_NE(status.error().where.find(axis), std::string::npos) << status.error().text();
    EXPECT_NE(status.error().where.find(" s"), std::string::npos) << status.error().text();
  }
  cell::CellSetup cell_ = testing::demo_cell();
  MotionPlan plan_;
};

TEST_F(Spoiled, Speed) {
  plan_.period_s /= 4;
  for (MotionSample& s : plan_.samples) {
    for (double& v : s.qd) v *= 4;
  }
  cell_.limits.joint_acceleration.fill(1e9), cell_.limits.joint_jerk.fill(1e9);
  refuses("plan.speed", "J1");
}
TEST_F(Spoiled, Acceleration) {
  cell_.limits.joint_acceleration[0] /= 1.5;
  refuses("plan.acceleration", "J1");
}
TEST_F(Spoiled, Jerk) {
  cell_.limits.joint_jerk[0] /= 1.5;
  refuses("plan.jerk", "J1");
}
TEST_F(Spoiled, OneSampleOutOfLine) {
  plan_.samples[plan_.samples.size() / 2].qd[3] += 0.01;
  refuses("plan.jerk", "J4");
}
TEST_F(Spoiled, PositionsThatDoNotBelongToTheSpeeds) {
  plan_.samples[plan_.samples.size() / 2].q[3] += 0.001;
  refuses("plan.consistency", "J4");
}
TEST_F(Spoiled, Limit) {
  cell_.arm.upper[0] = rad(39);
  refuses("plan.limit", "J1");
}
TEST_F(Spoiled, NoRestAtTheEnd) {
  plan_.samples.resize(plan_.samples.size() / 2);
  refuses("plan.rest", "J1");
}
TEST_F(Spoiled, NotANumber) {
  plan_.samples[3].q[2] = std::nan("");
  refuses("plan.limit", "J3");
}
TEST_F(Spoiled, NotANumberInTheSpeed) {
  plan_.samples[3].qd[2] = std::nan("");
  refuses("plan.jerk", "J3");
}
TEST_F(Spoiled, SingularWristWhileScanning) {
  for (MotionSample& s : plan_.samples) s.q[4] = rad(3);
  EXPECT_TRUE(preflight(cell_, plan_).ok()) << "a joint move may pass the singularity";
  plan_.passes.push_back({"pass", 0.2, 0.4});
  refuses("plan.singularity", "J5");
}

}  // namespace
}  // namespace weldcell::plan
