// The limits as properties of random motions, judged without preflight(); `scripts/bench robot --plans` does
// the same for every arm.
#include <gtest/gtest.h>

#include <cstdio>

#include "bench/random_plans.hpp"
#include "unit/plan/demo_cell.hpp"

namespace weldcell::bench {
namespace {

constexpr std::uint64_t kSeed = 2601;

void expect_all_keep_the_limits(Motion motion, int count, int least) {
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  const cell::CellSetup cell = testing::demo_cell();
  std::mt19937_64 random(kSeed);
  PlanTally tally;
  for (int n = 0; n < count; ++n) try_plan(cell, motion, random, tally);
  EXPECT_EQ(tally.broken, 0) << tally.first_broken;
  EXPECT_GE(tally.planned[static_cast<std::size_t>(motion)], least);
}

TEST(RandomPlans, PointToPointKeepsTheLimits) { expect_all_keep_the_limits(Motion::PointToPoint, 300, 300); }
TEST(RandomPlans, LinesKeepTheLimits) { expect_all_keep_the_limits(Motion::Line, 20, 5); }
TEST(RandomPlans, SpiralsKeepTheLimits) { expect_all_keep_the_limits(Motion::Spiral, 10, 2); }

/// The judge sees what it is for: each fault put into a good plan is named.
TEST(RandomPlans, TheJudgeNamesWhatIsBroken) {
  const cell::CellSetup cell = testing::demo_cell();
  kinematics::Joints to = cell.home;
  to[0] += 0.5;
  const auto good = plan::joint_move(cell, cell.home, to);
  ASSERT_TRUE(good.ok());
  EXPECT_EQ(judge(cell, *good).broken(), "");

  plan::MotionPlan jump = *good;
  jump.samples[jump.samples.size() / 2].q[0] += 1e-3;
  const std::string jumped = judge(cell, jump).broken();
  EXPECT_NE(jumped.find("acceleration"), std::string::npos) << jumped;
  EXPECT_NE(jumped.find("jerk"), std::string::npos) << jumped;

  plan::MotionPlan hasty = *good;
  hasty.period_s /= 10;
  EXPECT_NE(judge(cell, hasty).broken().find("speed"), std::string::npos);

  plan::MotionPlan moving = *good;
  moving.samples.back().qd[0] = 0.01;
  EXPECT_NE(judge(cell, moving).broken().find("rest at the ends"), std::string::npos);

  plan::MotionPlan beyond = *good;
  for (auto& sample : beyond.samples) sample.q[3] = cell.arm.upper[3] - cell.limits.limit_margin_rad / 2;
  EXPECT_NE(judge(cell, beyond).broken().find("range"), std::string::npos);
}

}  // namespace
}  // namespace weldcell::bench
