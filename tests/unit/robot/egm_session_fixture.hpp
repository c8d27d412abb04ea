// A session that a simulated controller feeds, armed and with its first frame answered.
#pragma once

#include <cmath>
#include <string>

#include "unit/robot/controller_frames.hpp"
#include "weldcell/robot/egm_session.hpp"

namespace weldcell::robot {

inline constexpr Axes kStart{10, -20, 30, 0, 60, -90};
inline constexpr Axes kWay{20, 0, -10, 5, 0, 15};
inline constexpr double kAcceleration = 400, kSpeed = 100;  // of small_cell()

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

}  // namespace weldcell::robot
