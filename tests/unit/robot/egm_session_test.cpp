#include "weldcell/robot/egm_session.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "unit/robot/controller_frames.hpp"

namespace weldcell::robot {
namespace {

constexpr Axes kStart{10, -20, 30, 0, 60, -90};
constexpr Axes kWay{20, 0, -10, 5, 0, 15};
constexpr double kAcceleration = 400, kSpeed = 100;  // of small_cell()

class EgmSessionTest : public testing::Test {
 protected:
  void SetUp() override {
    session.set_armed(true);
    frames.send();
  }
  /// Begins a plan and checks that it did.
  void begin(const plan::MotionPlan& plan) {
    session.offer(&plan);
    frames.next();
    ASSERT_EQ(session.report().refusal, EgmRefusal::None) << to_string(session.report().refusal);
    ASSERT_EQ(session.report().phase, EgmPhase::Following);
  }
  EgmRefusal refusal_of(const plan::MotionPlan& plan) {
    session.offer(&plan);
    frames.next();
    return session.report().refusal;
  }
  void expect_at(const Axes& a, const Axes& b, double tolerance, const std::string& where = {}) {
    for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(a[i], b[i], tolerance) << where << " J" << i + 1;
  }
  /// Steps until the phase is left, holding every reference to the limits by its own differences.
  void run_within_limits(EgmPhase while_in, double ms = 4, double acceleration = kAcceleration * 1.1) {
    Axes last = frames.joints, last_speed{};
    bool first = true;
    for (int k = 0; k < 5000 && session.report().phase == while_in; ++k) {
      const Reply reply = frames.next(ms);
      for (std::size_t i = 0; i < 6; ++i) {
        const double speed = (reply.joints[i] - last[i]) / (ms * 1e-3);
        EXPECT_LE(std::abs(speed), kSpeed * 1.02 + 1e-6);
        if (!first) {
          EXPECT_LE(std::abs(speed - last_speed[i]) / (ms * 1e-3), acceleration + 1e-3) << "J" << i + 1;
        }
        last_speed[i] = speed;
      }
      first = false;
      last = reply.joints;
    }
    EXPECT_NE(session.report().phase, while_in) << "did not end";
  }

  EgmSession session{small_cell()};
  Frames frames{session};
};

TEST_F(EgmSessionTest, FirstReplyIsWhereTheRobotIs) {
  EgmSession fresh(small_cell());
  Frames other(fresh);
  other.joints = {1, 2, 3, 4, 5, 6};
  const auto reply = other.send();
  ASSERT_TRUE(reply);
  EXPECT_TRUE(reply->correction);
  EXPECT_EQ(reply->seqno, 0U);
  EXPECT_EQ(reply->joints, other.joints);
  EXPECT_EQ(reply->speed, Axes{});
  EXPECT_EQ(fresh.report().session, 1U);
  EXPECT_EQ(fresh.report().phase, EgmPhase::Holding);
}

TEST_F(EgmSessionTest, OneReplyAFrameWithItsOwnCount) {
  for (std::uint32_t k = 1; k < 20; ++k) EXPECT_EQ(frames.next().seqno, k);
  EXPECT_EQ(session.report().session, 1U);
}

TEST_F(EgmSessionTest, HoldsItsReferenceWhileTheArmSags) {
  frames.pass(4);
  frames.joints[1] += 0.01;
  const auto reply = frames.send();
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->joints, kStart);
}

TEST_F(EgmSessionTest, WaitsAtTheMeasuredJointsUntilTheControllerRuns) {
  EgmSession fresh(small_cell());
  Frames other(fresh);
  other.mci = wire::MciState::Stopped;
  other.send();
  EXPECT_EQ(fresh.report().phase, EgmPhase::Waiting);
  other.pass(4);
  other.joints[0] = 55;
  auto reply = other.send();
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->joints, other.joints);
  other.mci = wire::MciState::Running;
  other.rapid = wire::RapidState::Undefined;
  other.next();
  EXPECT_EQ(fresh.report().phase, EgmPhase::Holding) << "RAPID UNDEFINED counts as running";
}

TEST_F(EgmSessionTest, MalformedDatagramsGetNoAnswerAndChangeNothing) {
  std::array<std::byte, 512> out{};
  const std::vector<std::byte> noise(100, std::byte{0xEE});
  EXPECT_EQ(session.on_datagram(noise, frames.now, out), 0U);
  EXPECT_EQ(session.on_datagram({}, frames.now, out), 0U);
  frames.pass(4);
  frames.joints[2] = std::nan("");
  EXPECT_FALSE(frames.send());
  EXPECT_EQ(session.report().malformed, 3U);
  frames.joints = kStart;
  EXPECT_EQ(frames.next().joints, kStart);
}

TEST_F(EgmSessionTest, DuplicateAndLateFramesGetNoAnswer) {
  frames.next();
  EXPECT_FALSE(frames.send());
  const auto seqno = frames.seqno, tm = frames.tm;
  frames.next();
  frames.next();
  frames.seqno = seqno;
  frames.tm = tm;
  EXPECT_FALSE(frames.send());
  EXPECT_EQ(session.report().stale, 2U);
  EXPECT_EQ(session.report().session, 1U);
}

TEST_F(EgmSessionTest, CountsWrapWithoutANewSession) {
  EgmSession fresh(small_cell());
  Frames other(fresh);
  other.seqno = std::numeric_limits<std::uint32_t>::max() - 1;
  other.tm = std::numeric_limits<std::uint32_t>::max() - 6;
  other.send();
  for (int k = 0; k < 5; ++k) other.next();
  EXPECT_EQ(fresh.report().session, 1U);
  EXPECT_EQ(fresh.report().stale, 0U);
}

TEST_F(EgmSessionTest, SessionBeginsAnewBySeqnoByClockAndBySilence) {
  for (int k = 0; k < 300; ++k) frames.next();
  frames.pass(4);
  frames.seqno = 0;  // the channel was set up again
  frames.joints[0] = 12;
  auto reply = frames.send();
  ASSERT_TRUE(reply);
  EXPECT_EQ(session.report().session, 2U);
  EXPECT_EQ(reply->seqno, 0U);
  EXPECT_EQ(reply->joints[0], 12);

  frames.pass(4);
  frames.tm = 100;  // the controller was started again, its count went on
  frames.joints[0] = 14;
  reply = frames.send();
  ASSERT_TRUE(reply);
  EXPECT_EQ(session.report().session, 3U);
  EXPECT_EQ(reply->joints[0], 14);

  frames.next();
  frames.pass(501, 125);
  frames.joints[0] = 16;
  reply = frames.send();
  ASSERT_TRUE(reply);
  EXPECT_EQ(session.report().session, 4U);
  EXPECT_EQ(reply->joints[0], 16);

  frames.pass(499, 125);
  frames.joints[0] = 18;
  reply = frames.send();
  ASSERT_TRUE(reply);
  EXPECT_EQ(session.report().session, 4U);
  EXPECT_EQ(reply->joints[0], 16) << "the reference is held within a session";
}

TEST_F(EgmSessionTest, BothCountsFarBackAreANewSession) {
  for (int k = 0; k < 1000; ++k) frames.next();
  frames.seqno = 0;
  frames.tm = 10;
  frames.now = frames.now + 4'000'000;
  EXPECT_TRUE(frames.send());
  EXPECT_EQ(session.report().session, 2U);
}

TEST_F(EgmSessionTest, FollowsThePlanOnTheControllersClock) {
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

TEST_F(EgmSessionTest, SpeedLeadsByHalfACycleAndTheFilter) {
  cell::CellSetup cell = small_cell();
  cell.egm.cycle_ms = 4;
  // A filter that forgets all but exp(-1) in a cycle: 1 / (2 pi 4 ms) = 39.8 Hz.
  cell.egm.low_pass_hz = 1 / (2 * kPi * 0.004);
  EXPECT_NEAR(EgmSession(cell).speed_lead_s(), 0.002 + 0.004 / (std::exp(1.0) - 1), 1e-9);
}

TEST_F(EgmSessionTest, HostJitterDoesNotMoveThePlan) {
  const auto plan = smooth_plan(1, kStart, kWay, 1.0);
  begin(plan);
  for (int k = 1; k <= 100; ++k) {
    frames.now = frames.now + (k % 3 - 1) * 1'500'000;
    const Reply reply = frames.next();
    ASSERT_NEAR(reply.joints[0], deg(plan::sample_at(plan, 0.004 * k).q[0]), 1e-9);
  }
}

TEST_F(EgmSessionTest, FallsBackToTmWithoutFeedbackTime) {
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

TEST_F(EgmSessionTest, EndsAtTheLastSampleAtRest) {
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

TEST_F(EgmSessionTest, SecondPlanBeginsWhereTheFirstEnded) {
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

TEST_F(EgmSessionTest, LostFramesDoNotShiftThePlan) {
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

TEST_F(EgmSessionTest, LongGapStopsInsteadOfCatchingUp) {
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

TEST_F(EgmSessionTest, RefusesAPlanThatBeginsElsewhere) {
  Axes off = kStart;
  off[3] += 0.21;
  const auto plan = smooth_plan(1, off, kWay, 1.0);
  EXPECT_EQ(refusal_of(plan), EgmRefusal::NotAtStart);
  EXPECT_FALSE(session.uses(&plan));
  EXPECT_EQ(session.report().phase, EgmPhase::Holding);
  EXPECT_EQ(refusal_of(plan::MotionPlan{}), EgmRefusal::NotAtStart);
}

TEST_F(EgmSessionTest, SmallOffsetAtTheStartFadesOutWithinTheLimits) {
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

TEST_F(EgmSessionTest, RefusesWhileDisarmedNotRunningOrBusy) {
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

TEST_F(EgmSessionTest, StopBetweenOfferAndFrameWins) {
  const auto plan = smooth_plan(1, kStart, kWay, 1.0);
  session.offer(&plan);
  session.request_stop();
  frames.next();
  EXPECT_EQ(session.report().refusal, EgmRefusal::Stopped);
  begin(plan);
}

TEST_F(EgmSessionTest, StopRampsDownInTheSameCycleAndStays) {
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

TEST_F(EgmSessionTest, StopDuringAccelerationStaysWithinTheLimits) {
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

TEST_F(EgmSessionTest, StopStaysOnThePathAndKeepsFourTimesTheJerk) {
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

TEST_F(EgmSessionTest, DisarmingRampsDown) {
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

TEST_F(EgmSessionTest, ControllerThatLeavesRunningDropsThePlan) {
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

TEST_F(EgmSessionTest, NewSessionInAMotionDropsThePlan) {
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

TEST_F(EgmSessionTest, TooFastPlanIsCutCountedAndAbandoned) {
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

TEST_F(EgmSessionTest, LittleOverTheLimitIsCutAndCaughtUp) {
  // Peak acceleration 2 pi * 60 / 0.88^2 = 487 deg/s2 against 440, peak speed 136 against 102 would be too
  // much: shorter way.
  const auto plan = smooth_plan(1, kStart, {26, 0, 0, 0, 0, 0}, 0.6);  // 87 deg/s, 454 deg/s2
  begin(plan);
  run_within_limits(EgmPhase::Following);
  EXPECT_GT(session.report().limited, 0U);
  EXPECT_TRUE(session.report().plan_done);
  EXPECT_NEAR(frames.joints[0], kStart[0] + 26, 1e-9);
}

TEST_F(EgmSessionTest, RangeIsNeverLeft) {
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

TEST_F(EgmSessionTest, PlanThatIsNoNumberStops) {
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

TEST_F(EgmSessionTest, RefusalTextsAreDistinct) {
  std::vector<std::string> texts;
  for (int k = 0; k <= static_cast<int>(EgmRefusal::Stopped); ++k)
    texts.emplace_back(to_string(static_cast<EgmRefusal>(k)));
  std::sort(texts.begin(), texts.end());
  EXPECT_EQ(std::adjacent_find(texts.begin(), texts.end()), texts.end());
}

}  // namespace
}  // namespace weldcell::robot
