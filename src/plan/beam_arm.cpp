#include "beam_arm.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace weldcell::plan {

BeamArm::BeamArm(const cell::CellSetup& cell, const AxisLimits& limits, double top_z_mm)
    : cell_(cell),
      limits_(limits),
      beam_z_mm_(top_z_mm + cell.laser.standoff_mm),
      T_laser_flange_(cell.laser.T_flange_laser.inverse()) {}

Transform<Base, Flange> BeamArm::flange(const Eigen::Vector3d& place) const {
  const double c = std::cos(place.z()), s = std::sin(place.z());
  Transform<Base, Laser> beam;
  beam.iso.linear() << c, s, 0, s, -c, 0, 0, 0, -1;
  beam.iso.translation() = Eigen::Vector3d(place.x(), place.y(), beam_z_mm_);
  return beam * T_laser_flange_;
}

bool BeamArm::joints(const Eigen::Vector3d& place, const kinematics::Joints& near, double max_step_rad,
                     kinematics::Joints& out) const {
  return kinematics::inverse_near(cell_.arm, flange(place), near, cell_.limits.limit_margin_rad, max_step_rad,
                                  out);
}

bool BeamArm::reach(const Eigen::Vector3d& from, const kinematics::Joints& at_from, const Eigen::Vector3d& to,
                    kinematics::Joints& at_to) const {
  constexpr int kSteps = 24;
  kinematics::Joints q = at_from;
  for (int i = 1; i <= kSteps; ++i) {
    kinematics::Joints next{};
    if (!joints(from + (to - from) * i / kSteps, q, 2.0, next)) return false;
    if (std::abs(std::sin(next[4])) < cell_.limits.min_sin_j5) return false;
    q = next;
  }
  at_to = q;
  return true;
}

kinematics::Joints BeamArm::speeds(const kinematics::Joints& q, const BeamState& state) const {
  const Eigen::Vector3d foot(state.place.x(), state.place.y(), 0);
  const Eigen::Vector3d turning(0, 0, state.rate.z());
  Eigen::Matrix<double, 6, 1> twist;
  twist.head<3>() = Eigen::Vector3d(state.rate.x(), state.rate.y(), 0) +
                    turning.cross(kinematics::forward(cell_.arm, q).position_mm() - foot);
  twist.tail<3>() = turning;
  const Eigen::Matrix<double, 6, 1> qd = kinematics::jacobian(cell_.arm, q).partialPivLu().solve(twist);
  kinematics::Joints out{};
  for (int i = 0; i < 6; ++i) out[static_cast<std::size_t>(i)] = qd(i);
  return out;
}

double hurry_of(const AxisLimits& limits, const kinematics::Joints& before, const kinematics::Joints& now,
                const kinematics::Joints& after, double period_s) {
  double speed = 0, acceleration = 0, jerk = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    speed = std::max(speed, std::abs(now[i]) / limits.speed[i]);
    acceleration = std::max(acceleration, std::abs(after[i] - now[i]) / period_s / limits.acceleration[i]);
    jerk =
        std::max(jerk, std::abs(after[i] - 2 * now[i] + before[i]) / (period_s * period_s) / limits.jerk[i]);
  }
  return std::max({speed, std::sqrt(acceleration), std::cbrt(jerk)});
}

}  // namespace weldcell::plan
