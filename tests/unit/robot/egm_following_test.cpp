#include <algorithm>
#include <cmath>

#include "unit/robot/egm_session_fixture.hpp"

namespace weldcell::robot {
namespace {

using EgmFollowingTest = EgmSessionTest;

TEST_F(EgmFollowingTest, FollowsThePlanOnTheControllersClock) {
  const auto plan = smooth_plan(7, kStart, kWay, 1.0);
  begin(plan);
  EXPECT_TRUE(session.uses(&plan));
  double t = 0;
  for (int k = 0; k < 200; ++k) {
    const Reply reply = frames.next(4.032);
    t += 0.004032;
    const auto sample = plan::sample_at(plan, t);
    const auto ahead = plan::sample_at(plan, t + session.speed_lead_s());
    for (std::size_t i = 0; i < 6; ++i) {
      ASSERT_NEAR(reply.joints[i], deg(sample.q[i]), 1e-9) << "cycle " << k;
      ASSERT_NEAR(reply.speed[i], deg(ahead.qd[i]), 1e-6) << "cycle " << k;
    }
    ASSERT_NEAR(session.report().plan_time_s, t, 1e-9);
  }
  EXPECT_EQ(session.report().plan_id, 7U);
  EXPECT_EQ(session.report().limited, 0U);
}

TEST_F(EgmFollowingTest, SpeedLeadsByHalfACycleAndTheFilter) {
  cell::CellSetup cell = small_cell();
  cell.egm.cycle_ms = 4;
  // A filter that forgets all but exp(-1) in a cycle: 1 / (2 pi 4 ms) = 39.8 Hz.
  cell.egm.low_pass_hz = 1 / (2 * kPi * 0.004);
  EXPECT_NEAR(EgmSession(cell).speed_lead_s(), 0.002 + 0.004 / (std::exp(1.0) - 1), 1e-9);
}

TEST_F(EgmFollowingTest, HostJitterDoesNotMoveThePlan) {
  const auto plan = smooth_plan(1, kStart, kWay, 1.0);
  begin(plan);
  for (int k = 1; k <= 100; ++k) {
    frames.now = frames.now + (k % 3 - 1) * 1'500'000;
    const Reply reply = frames.next();
    ASSERT_NEAR(reply.joints[0], deg(plan::sample_at(plan, 0.004 * k).q[0]), 1e-9);
  }
}

TEST_F(EgmFollowingTest, FallsBackToTmWithoutFeedbackTime) {
  frames.with_time = false;
  frames.next();
  const auto plan = smooth_plan(1, kStart, kWay, 1.0);
  begin(plan);
  const auto tm0 = frames.tm;
  for (int k = 0; k < 100; ++k) {
    const Reply reply = frames.next(4.032);
    ASSERT_NEAR(session.report().plan_time_s, 1e-3 * (frames.tm - tm0), 1e-9);
    ASSERT_NEAR(reply.joints[0], deg(plan::sample_at(plan, session.report().plan_time_s).q[0]), 1e-6);
  }
}

TEST_F(EgmFollowingTest, EndsAtTheLastSampleAtRest) {
  const auto plan = smooth_plan(3, kStart, kWay, 0.8);
  begin(plan);
  run_within_limits(EgmPhase::Following);
  EXPECT_EQ(session.report().phase, EgmPhase::Holding);
  EXPECT_TRUE(session.report().plan_done);
  EXPECT_EQ(session.report().plan_id, 3U);
  EXPECT_FALSE(session.uses(&plan));
  const Reply reply = frames.next();
  EXPECT_EQ(reply.speed, Axes{});
  for (std::size_t i = 0; i < 6; ++i) EXPECT_DOUBLE_EQ(reply.joints[i], deg(plan.samples.back().q[i]));
  EXPECT_EQ(session.report().limited, 0U);
}

TEST_F(EgmFollowingTest, SecondPlanBeginsWhereTheFirstEnded) {
  const auto there = smooth_plan(1, kStart, kWay, 0.8);
  begin(there);
  run_within_limits(EgmPhase::Following);
  Axes end = kStart, back = kWay;
  for (std::size_t i = 0; i < 6; ++i) {
    end[i] += kWay[i];
    back[i] = -kWay[i];
  }
  const auto home = smooth_plan(2, end, back, 0.8);
  begin(home);
  EXPECT_FALSE(session.report().plan_done);
  run_within_limits(EgmPhase::Following);
  expect_at(frames.joints, kStart, 1e-9);
}

TEST_F(EgmFollowingTest, LostFramesDoNotShiftThePlan) {
  const auto plan = smooth_plan(1, kStart, kWay, 2.0);
  begin(plan);
  double t = 0;
  for (const std::uint32_t lost : {0U, 0U, 1U, 0U, 5U, 0U, 12U, 0U, 0U, 23U, 0U}) {
    const Reply reply = frames.next(4.0 * (lost + 1), lost + 1);
    t += 0.004 * (lost + 1);
    ASSERT_NEAR(reply.joints[0], deg(plan::sample_at(plan, t).q[0]), 1e-9) << lost << " lost";
  }
  EXPECT_EQ(session.report().limited, 0U);
  EXPECT_EQ(session.report().phase, EgmPhase::Following);
}

TEST_F(EgmFollowingTest, LongGapStopsInsteadOfCatchingUp) {
  const auto plan = smooth_plan(1, kStart, kWay, 1.0);
  begin(plan);
  for (int k = 0; k < 125; ++k) frames.next();
  const Axes before = frames.joints;
  const Reply reply = frames.next(104, 26);
  EXPECT_EQ(session.report().phase, EgmPhase::Stopping);
  EXPECT_LT(reply.joints[0] - before[0], 40 * 0.004 + 0.01);
  run_within_limits(EgmPhase::Stopping);
  EXPECT_EQ(session.report().phase, EgmPhase::Holding);
  EXPECT_FALSE(session.report().plan_done);
  EXPECT_EQ(session.report().session, 1U);
}

TEST_F(EgmFollowingTest, RefusesAPlanThatBeginsElsewhere) {
  Axes off = kStart;
  off[3] += 0.21;
  const auto plan = smooth_plan(1, off, kWay, 1.0);
  EXPECT_EQ(refusal_of(plan), EgmRefusal::NotAtStart);
  EXPECT_FALSE(session.uses(&plan));
  EXPECT_EQ(session.report().phase, EgmPhase::Holding);
  EXPECT_EQ(refusal_of(plan::MotionPlan{}), EgmRefusal::NotAtStart);
}

TEST_F(EgmFollowingTest, SmallOffsetAtTheStartFadesOutWithinTheLimits) {
  Axes near = kStart;
  near[0] += 0.19;
  near[4] -= 0.15;
  const auto plan = smooth_plan(1, near, kWay, 1.2);
  begin(plan);
  run_within_limits(EgmPhase::Following);
  EXPECT_TRUE(session.report().plan_done);
  EXPECT_EQ(session.report().limited, 0U);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_DOUBLE_EQ(frames.joints[i], deg(plan.samples.back().q[i]));
}

TEST_F(EgmFollowingTest, RefusesWhileDisarmedNotRunningOrBusy) {
  const auto plan = smooth_plan(1, kStart, kWay, 1.0);
  session.set_armed(false);
  EXPECT_EQ(refusal_of(plan), EgmRefusal::Disarmed);
  session.set_armed(true);
  EXPECT_FALSE(session.uses(&plan)) << "a refused plan is not begun later";
  frames.motors = wire::MotorState::Off;
  EXPECT_EQ(refusal_of(plan), EgmRefusal::NotRunning);
  frames.motors = wire::MotorState::On;
  frames.next();
  begin(plan);
  const auto other = smooth_plan(2, kStart, kWay, 1.0);
  EXPECT_EQ(refusal_of(other), EgmRefusal::AlreadyFollowing);
  EXPECT_EQ(session.report().plan_id, 1U);
  EXPECT_EQ(session.report().phase, EgmPhase::Following);
}

TEST_F(EgmFollowingTest, RefusalTextsAreDistinct) {
  std::vector<std::string> texts;
  for (int k = 0; k <= static_cast<int>(EgmRefusal::Stopped); ++k)
    texts.emplace_back(to_string(static_cast<EgmRefusal>(k)));
  std::sort(texts.begin(), texts.end());
  EXPECT_EQ(std::adjacent_find(texts.begin(), texts.end()), texts.end());
}

}  // namespace
}  // namespace weldcell::robot
