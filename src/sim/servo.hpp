// The arm behind its servos: follows the reference after a dead time; its postures of the last seconds can be
// asked. Pure.
#pragma once

#include <array>

#include "weldcell/base/time.hpp"
#include "weldcell/kinematics/arm_model.hpp"

namespace weldcell::sim {

class Servo {
 public:
  Servo(double cycle_s, double dead_time_s, const kinematics::Joints& at);

  /// The reference computed in this cycle: the arm is there one cycle and the dead time later. Afterwards
  /// posture() is the arm's at `now`.
  void step(HostTime now, const kinematics::Joints& reference);
  const kinematics::Joints& posture() const { return record_[at_]; }
  /// Cubic between cycles. Known for the last two seconds, and ahead as far as the dead time: what the arm
  /// will do there is decided already. Clamped beyond. step() must have been called at equal intervals of the
  /// cycle.
  kinematics::Joints posture_at(HostTime t) const;

 private:
  static constexpr std::size_t kRemembered = 512;
  /// Posture k cycles from now; k may be negative.
  kinematics::Joints at_cycle(int k) const;

  double cycle_s_, delay_cycles_;
  std::array<kinematics::Joints, 64> line_{};
  std::size_t line_at_ = 0;
  std::array<kinematics::Joints, kRemembered> record_{};
  std::size_t at_ = 0;
  int count_ = 1;
  HostTime now_;
};

}  // namespace weldcell::sim
