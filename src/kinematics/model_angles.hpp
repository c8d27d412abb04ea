// Joint angles as the OPW model counts them, and the wrist centre that follows from them. Pure, real-time
// safe.
#pragma once

#include <cmath>

#include "weldcell/kinematics/arm_model.hpp"

namespace weldcell::kinematics {

/// The upper arm from elbow to wrist centre as one link: its length and its angle against the model's zero.
struct UpperArm {
  explicit UpperArm(const ArmModel& arm)
      : length_mm(std::hypot(arm.a2, arm.c3)), angle_rad(std::atan2(arm.a2, arm.c3)) {}
  double length_mm;
  double angle_rad;
};

inline Joints to_model(const ArmModel& arm, const Joints& joints) {
  Joints serial = joints;
  serial[2] -= arm.j3_j2_coupling * joints[1];
  Joints theta{};
  for (std::size_t i = 0; i < 6; ++i) theta[i] = arm.sign[i] * serial[i] - arm.offset[i];
  return theta;
}

inline Joints from_model(const ArmModel& arm, const Joints& theta) {
  Joints joints{};
  for (std::size_t i = 0; i < 6; ++i) joints[i] = arm.sign[i] * (theta[i] + arm.offset[i]);
  joints[2] += arm.j3_j2_coupling * joints[1];
  return joints;
}

/// How far the wrist centre lies in front of axis 1 (mm, negative: behind), and the elbow's angle from
/// stretched.
struct ArmShape {
  double in_front_mm;
  double elbow_rad;
};

inline ArmShape shape_of(const ArmModel& arm, const Joints& theta) {
  const UpperArm upper(arm);
  const double elbow = theta[2] + upper.angle_rad;
  return {arm.a1 + arm.c2 * std::sin(theta[1]) + upper.length_mm * std::sin(theta[1] + elbow), elbow};
}

}  // namespace weldcell::kinematics
