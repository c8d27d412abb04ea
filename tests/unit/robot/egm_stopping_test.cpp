#include <algorithm>
#include <cmath>

#include "unit/robot/egm_session_fixture.hpp"

namespace weldcell::robot {
namespace {

using EgmStoppingTest = EgmSessionTest;

TEST_F(EgmStoppingTest, StopBetweenOfferAndFrameWins) {
  const auto plan = smooth_plan(1, kStart, kWay, 1.0);
  session.offer(&plan);
  session.request_stop();
  frames.next();
  EXPECT_EQ(session.report().refusal, EgmRefusal::Stopped);
  begin(plan);
}

TEST_F(EgmStoppingTest, StopRampsDownInTheSameCycleAndStays) {
  const auto plan = smooth_plan(1, kStart, kWay, 1.0);
  begin(plan);
  for (int k = 0; k < 125; ++k) frames.next();
  const Reply moving = frames.next();
  EXPECT_NEAR(moving.speed[0], 40, 0.1);
  session.request_stop();
  const Reply first = frames.next();
  EXPECT_EQ(session.report().phase, EgmPhase::Stopping);
  EXPECT_TRUE(session.uses(&plan)) << "it stops along the plan";
  EXPECT_LT(first.speed[0], moving.speed[0]);
  run_within_limits(EgmPhase::Stopping);
  EXPECT_FALSE(session.uses(&plan));
  const Reply rest = frames.next();
  EXPECT_EQ(session.report().phase, EgmPhase::Holding);
  EXPECT_EQ(rest.speed, Axes{});
  EXPECT_FALSE(session.report().plan_done);
  // 40 deg/s at 400 deg/s2: 0.1 s and 2 deg, and half of a jerk phase of 400/16000 s more; all axes in step.
  EXPECT_NEAR(rest.joints[0] - moving.joints[0], 40 * (0.1 + 0.025) / 2, 0.15);
  EXPECT_NEAR((rest.joints[2] - moving.joints[2]) / (rest.joints[0] - moving.joints[0]), -0.5, 1e-3);
  for (int k = 0; k < 50; ++k) EXPECT_EQ(frames.next().joints, rest.joints);
  EXPECT_EQ(session.report().limited, 0U);
}

TEST_F(EgmStoppingTest, StopDuringAccelerationStaysWithinTheLimits) {
  // Peaks: 100 deg/s and 2 pi * 40 / 0.8^2 = 393 deg/s2.
  const auto plan = smooth_plan(1, kStart, {40, 0, 0, 0, 0, -40}, 0.8);
  for (int cycles = 5; cycles < 200; cycles += 11) {
    EgmSession fresh(small_cell());
    fresh.set_armed(true);
    Frames other(fresh);
    other.send();
    fresh.offer(&plan);
    other.next();
    Axes last = other.joints, last_speed{};
    for (int k = 0; k < 600; ++k) {
      if (k == cycles) fresh.request_stop();
      const Reply reply = other.next();
      for (std::size_t i = 0; i < 6; ++i) {
        const double speed = (reply.joints[i] - last[i]) / 0.004;
        ASSERT_LE(std::abs(speed - last_speed[i]) / 0.004, kAcceleration * 1.1)
            << "stop at " << cycles << " cycle " << k;
        last_speed[i] = speed;
      }
      last = reply.joints;
    }
    EXPECT_EQ(fresh.report().phase, EgmPhase::Holding);
    // The last step to rest may be cut; nothing else.
    EXPECT_LE(fresh.report().limited, 8U) << "stop at " << cycles;
  }
}

TEST_F(EgmStoppingTest, StopStaysOnThePathAndKeepsFourTimesTheJerk) {
  // A curve in joint space: two axes out of step.
  plan::MotionPlan plan = smooth_plan(1, kStart, {30, 0, 0, 0, 0, 0}, 1.2);
  for (std::size_t k = 0; k < plan.samples.size(); ++k) {
    const double u = static_cast<double>(k) / static_cast<double>(plan.samples.size() - 1), w = 2 * kPi;
    const double duration = plan.duration_s(), rise = 1 - std::cos(w * u), fall = std::sin(w * u);
    plan.samples[k].q[1] += rad(1.5 * rise * rise);
    plan.samples[k].qd[1] += rad(1.5 * 2 * rise * w * fall / duration);
  }
  for (int cycles = 20; cycles < 290; cycles += 13) {
    EgmSession fresh(small_cell());
    fresh.set_armed(true);
    Frames other(fresh);
    other.send();
    fresh.offer(&plan);
    other.next();
    Axes last = other.joints, last_speed{}, last_acceleration{};
    double off = 0, jerk = 0;
    for (int k = 0; k < 450; ++k) {
      if (k == cycles) fresh.request_stop();
      const Reply reply = other.next();
      double nearest = 1e9;
      for (std::size_t n = 0; n < plan.samples.size(); ++n) {
        const auto sample = plan::sample_at(plan, 0.004 * static_cast<double>(n));
        nearest = std::min(
            nearest, std::hypot(reply.joints[0] - deg(sample.q[0]), reply.joints[1] - deg(sample.q[1])));
      }
      if (k >= cycles) off = std::max(off, nearest);
      for (std::size_t i = 0; i < 6; ++i) {
        const double speed = (reply.joints[i] - last[i]) / 0.004, a = (speed - last_speed[i]) / 0.004;
        if (k > 3) jerk = std::max(jerk, std::abs(a - last_acceleration[i]) / 0.004);
        last_speed[i] = speed;
        last_acceleration[i] = a;
      }
      last = reply.joints;
    }
    EXPECT_EQ(fresh.report().phase, EgmPhase::Holding);
    EXPECT_LT(off, 0.15) << "half a sample's step at 60 deg/s is 0.12; stop at " << cycles;
    // Four times 4000 with a quarter of slack, and the last step to rest.
    EXPECT_LT(jerk, 4000 * 6) << "stop at " << cycles;
  }
}

TEST_F(EgmStoppingTest, DisarmingRampsDown) {
  const auto plan = smooth_plan(1, kStart, kWay, 1.0);
  begin(plan);
  for (int k = 0; k < 60; ++k) frames.next();
  session.set_armed(false);
  frames.next();
  EXPECT_EQ(session.report().phase, EgmPhase::Stopping);
  run_within_limits(EgmPhase::Stopping);
  session.set_armed(true);
  for (int k = 0; k < 20; ++k) frames.next();
  EXPECT_EQ(session.report().phase, EgmPhase::Holding) << "arming again moves nothing";
}

TEST_F(EgmStoppingTest, ControllerThatLeavesRunningDropsThePlan) {
  for (int kind = 0; kind < 3; ++kind) {
    EgmSession fresh(small_cell());
    fresh.set_armed(true);
    Frames other(fresh);
    other.send();
    const auto plan = smooth_plan(1, kStart, kWay, 1.0);
    fresh.offer(&plan);
    for (int k = 0; k < 100; ++k) other.next();
    EXPECT_EQ(fresh.report().phase, EgmPhase::Following);
    if (kind == 0) other.motors = wire::MotorState::Off;
    if (kind == 1) other.mci = wire::MciState::Error;
    if (kind == 2) other.rapid = wire::RapidState::Stopped;
    other.pass(4);
    other.joints[0] -= 0.3;
    const auto reply = other.send();
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->joints, other.joints) << "nothing but the measured position";
    EXPECT_EQ(reply->speed, Axes{});
    EXPECT_EQ(fresh.report().phase, EgmPhase::Waiting);
    EXPECT_FALSE(fresh.uses(&plan));
    other.motors = wire::MotorState::On;
    other.mci = wire::MciState::Running;
    other.rapid = wire::RapidState::Running;
    const Axes rest = other.joints;
    for (int k = 0; k < 50; ++k) EXPECT_EQ(other.next().joints, rest);
    EXPECT_EQ(fresh.report().phase, EgmPhase::Holding);
    EXPECT_FALSE(fresh.report().plan_done);
  }
}

TEST_F(EgmStoppingTest, NewSessionInAMotionDropsThePlan) {
  const auto plan = smooth_plan(1, kStart, kWay, 1.0);
  begin(plan);
  for (int k = 0; k < 100; ++k) frames.next();
  frames.pass(4);
  frames.seqno = 0;
  const auto reply = frames.send();
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->joints, frames.joints);
  EXPECT_EQ(reply->speed, Axes{});
  EXPECT_FALSE(session.uses(&plan));
  EXPECT_EQ(session.report().phase, EgmPhase::Holding);
}

}  // namespace
}  // namespace weldcell::robot
