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

  /// The reference of this cycle; afterwards posture() is the arm's at `now`.
  void step(HostTime now, const kinematics::Joints& reference);
  const kinematics::Joints& posture() const { return record_[at_].joints; }
  /// Interpolated (cubic) between cycles; clamped to what is remembered (2 s).
  kinematics::Joints posture_at(HostTime t) const;

 private:
  static constexpr std::size_t kRemembered = 512;
  struct Record {
    HostTime t;
    kinematics::Joints joints{}, speed{};
  };
  const Record& back(std::size_t cycles) const { return record_[(at_ + kRemembered - cycles) % kRemembered]; }

  double cycle_s_, delay_cycles_;
  std::array<kinematics::Joints, 64> line_{};
  std::size_t line_at_ = 0;
  std::array<Record, kRemembered> record_{};
  std::size_t at_ = 0, count_ = 1;
};

}  // namespace weldcell::sim
