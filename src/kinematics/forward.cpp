#include <algorithm>
#include <cmath>

#include "model_angles.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::kinematics {

namespace {

Eigen::Matrix3d rot_z(double angle) {
  return Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}
Eigen::Matrix3d rot_y(double angle) {
  return Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
}

int quadrant(double angle) { return static_cast<int>(std::floor(deg(angle) / 90.0 + 1e-12)); }

}  // namespace

Transform<Base, Flange> forward(const ArmModel& arm, const Joints& joints) {
  const Joints t = to_model(arm, joints);
  const UpperArm upper(arm);
  const double tilt = t[1] + t[2] + upper.angle_rad;
  const Eigen::Vector3d wrist(arm.a1 + arm.c2 * std::sin(t[1]) + upper.length_mm * std::sin(tilt), arm.b,
                              arm.c1 + arm.c2 * std::cos(t[1]) + upper.length_mm * std::cos(tilt));
  const Eigen::Matrix3d turn = rot_z(t[0]);
  const Eigen::Matrix3d rotation = turn * rot_y(t[1] + t[2]) * rot_z(t[3]) * rot_y(t[4]) * rot_z(t[5]);
  Transform<Base, Flange> pose;
  pose.iso.linear() = rotation;
  pose.iso.translation() = turn * wrist + arm.c4 * rotation.col(2);
  return pose;
}

Eigen::Matrix<double, 6, 6> jacobian(const ArmModel& arm, const Joints& joints) {
  const Joints t = to_model(arm, joints);
  const UpperArm upper(arm);
  const Eigen::Matrix3d turn = rot_z(t[0]);
  const double tilt = t[1] + t[2] + upper.angle_rad;
  const Eigen::Vector3d shoulder = turn * Eigen::Vector3d(arm.a1, arm.b, arm.c1);
  const Eigen::Vector3d elbow =
      shoulder + turn * Eigen::Vector3d(arm.c2 * std::sin(t[1]), 0, arm.c2 * std::cos(t[1]));
  const Eigen::Vector3d wrist =
      elbow + turn * Eigen::Vector3d(upper.length_mm * std::sin(tilt), 0, upper.length_mm * std::cos(tilt));
  const Eigen::Matrix3d fore = turn * rot_y(t[1] + t[2]);
  const Eigen::Matrix3d hand = fore * rot_z(t[3]);
  const Eigen::Vector3d pointing = hand * rot_y(t[4]) * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d flange = wrist + arm.c4 * pointing;

  const std::array<Eigen::Vector3d, 6> axis{
      Eigen::Vector3d::UnitZ(), turn.col(1), turn.col(1), fore.col(2), hand.col(1), pointing};
  const std::array<Eigen::Vector3d, 6> at{Eigen::Vector3d::Zero(), shoulder, elbow, wrist, wrist, wrist};
  Eigen::Matrix<double, 6, 6> out;
  for (int i = 0; i < 6; ++i) {
    const auto k = static_cast<std::size_t>(i);
    out.block<3, 1>(0, i) = arm.sign[k] * axis[k].cross(flange - at[k]);
    out.block<3, 1>(3, i) = arm.sign[k] * axis[k];
  }
  out.col(1) -= arm.j3_j2_coupling * out.col(2);
  return out;
}

int branch_of(const ArmModel& arm, const Joints& joints) {
  const Joints t = to_model(arm, joints);
  const ArmShape shape = shape_of(arm, t);
  return (shape.in_front_mm < 0 ? 4 : 0) + (std::sin(shape.elbow_rad) < 0 ? 2 : 0) + (t[4] < 0 ? 1 : 0);
}

Configuration configuration(const ArmModel& arm, const Joints& joints) {
  // ABB's arms with a parallel linkage have no cfx: their linkage leaves one elbow only.
  const int cfx = arm.j3_j2_coupling != 0 ? 0 : branch_of(arm, joints);
  return {quadrant(joints[0]), quadrant(joints[3]), quadrant(joints[5]), cfx};
}

bool within_limits(const ArmModel& arm, const Joints& joints, double margin_rad) {
  for (std::size_t i = 0; i < 6; ++i) {
    if (!(joints[i] >= arm.lower[i] + margin_rad && joints[i] <= arm.upper[i] - margin_rad)) return false;
  }
  return true;
}

double dexterity(const ArmModel& arm, const Joints& joints) {
  const Joints t = to_model(arm, joints);
  const ArmShape shape = shape_of(arm, t);
  // The wrist centre is clear of axis 1 from half the reach outwards; nearer, J1 has to hurry.
  const double half_reach = 0.5 * (arm.a1 + arm.c2 + UpperArm(arm).length_mm);
  double worst = std::min({1.0, std::abs(std::sin(t[4])), std::abs(std::sin(shape.elbow_rad)),
                           std::abs(shape.in_front_mm) / half_reach});
  for (std::size_t i = 0; i < 6; ++i) {
    const double half_range = 0.5 * (arm.upper[i] - arm.lower[i]);
    const double margin = std::min(joints[i] - arm.lower[i], arm.upper[i] - joints[i]);
    worst = std::min(worst, half_range > 0 ? margin / half_range : 0.0);
  }
  return worst;
}

}  // namespace weldcell::kinematics
