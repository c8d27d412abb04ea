#include <algorithm>

#include "unit/robot/egm_session_fixture.hpp"

namespace weldcell::robot {
namespace {

using EgmLimitsTest = EgmSessionTest;

TEST_F(EgmLimitsTest, TooFastPlanIsCutCountedAndAbandoned) {
  const auto plan = smooth_plan(1, kStart, {90, 0, 0, 0, 0, 0}, 0.5);  // peak 360 deg/s, 2260 deg/s2
  begin(plan);
  run_within_limits(EgmPhase::Following);
  EXPECT_GT(session.report().limited, 0U);
  EXPECT_EQ(session.report().phase, EgmPhase::Stopping);
  run_within_limits(EgmPhase::Stopping);
  EXPECT_EQ(session.report().phase, EgmPhase::Holding);
  EXPECT_FALSE(session.report().plan_done);
  EXPECT_LT(frames.joints[0], 60);
}

TEST_F(EgmLimitsTest, LittleOverTheLimitIsCutAndCaughtUp) {
  // Peak acceleration 2 pi * 60 / 0.88^2 = 487 deg/s2 against 440, peak speed 136 against 102 would be too
  // much: shorter way.
  const auto plan = smooth_plan(1, kStart, {26, 0, 0, 0, 0, 0}, 0.6);  // 87 deg/s, 454 deg/s2
  begin(plan);
  run_within_limits(EgmPhase::Following);
  EXPECT_GT(session.report().limited, 0U);
  EXPECT_TRUE(session.report().plan_done);
  EXPECT_NEAR(frames.joints[0], kStart[0] + 26, 1e-9);
}

TEST_F(EgmLimitsTest, RangeIsNeverLeft) {
  Axes high = kStart;
  high[0] = 160;
  frames.joints = high;
  frames.pass(600, 150);
  frames.send();
  const auto plan = smooth_plan(1, high, {20, 0, 0, 0, 0, 0}, 1.0);  // to 180, the range ends at 170 less 1
  begin(plan);
  double farthest = 0;
  for (int k = 0; k < 1000; ++k) farthest = std::max(farthest, frames.next().joints[0]);
  EXPECT_LE(farthest, 169.0 + 1e-9);
  EXPECT_GT(farthest, 167.0);
  EXPECT_GT(session.report().limited, 0U);
  EXPECT_EQ(session.report().phase, EgmPhase::Holding);
  EXPECT_FALSE(session.report().plan_done);
}

TEST_F(EgmLimitsTest, PlanThatIsNoNumberStops) {
  auto plan = smooth_plan(1, kStart, kWay, 1.0);
  for (std::size_t k = 100; k < plan.samples.size(); ++k) plan.samples[k].q[1] = std::nan("");
  begin(plan);
  for (int k = 0; k < 300; ++k) {
    const Reply reply = frames.next();
    for (std::size_t i = 0; i < 6; ++i) {
      ASSERT_TRUE(std::isfinite(reply.joints[i]));
      ASSERT_TRUE(std::isfinite(reply.speed[i]));
    }
  }
  EXPECT_EQ(session.report().phase, EgmPhase::Holding);
  EXPECT_FALSE(session.report().plan_done);
}

}  // namespace
}  // namespace weldcell::robot
