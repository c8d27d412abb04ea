// Pose guidance of the simulated controller: the tool's pose in the sensor frame, followed through the
// joints.
#include <cmath>

#include "egm.pb.h"
#include "sim/egm_channel.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::sim {

using kinematics::Joints;

namespace {

/// False when there is no orientation, or none that is one. Euler angles win when both are given.
bool orientation_of(const abb::egm::EgmPose& pose, Eigen::Quaterniond& out) {
  if (pose.has_euler()) {
    out = Eigen::AngleAxisd(rad(pose.euler().z()), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(rad(pose.euler().y()), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(rad(pose.euler().x()), Eigen::Vector3d::UnitX());
  } else if (pose.has_orient()) {
    out = Eigen::Quaterniond(pose.orient().u0(), pose.orient().u1(), pose.orient().u2(), pose.orient().u3());
  } else {
    return false;
  }
  const double norm = out.norm();
  if (!std::isfinite(norm) || std::abs(norm - 1) > 1e-3) return false;
  out.normalize();
  return true;
}

}  // namespace

bool EgmChannel::take_pose(const abb::egm::EgmSensor& message) {
  const abb::egm::EgmPose& pose = message.planned().cartesian();
  if (!message.has_planned() || !message.planned().has_cartesian() || !pose.has_pos())
    return refuse("no pose");
  const Eigen::Vector3d at(pose.pos().x(), pose.pos().y(), pose.pos().z());
  if (!at.allFinite()) return refuse("a position is not finite");
  Eigen::Quaterniond turned;
  if (!orientation_of(pose, turned)) return refuse("no orientation of length one");
  Eigen::Isometry3d wanted = Eigen::Isometry3d::Identity();
  wanted.translate(at);
  wanted.rotate(turned);
  const Eigen::Isometry3d target = activation_.sensor * wanted;
  const auto solutions = kinematics::inverse(arm_, {target * activation_.tool.inverse()}, reference_);
  if (solutions.empty()) {
    // Out of reach: the arm goes no farther, and the controller says so.
    out_of_range_ = true;
    return true;
  }
  pose_target_ = target;
  reference_ = solutions.front();
  speed_reference_ = {};
  position_given_ = true;
  return true;
}

bool EgmChannel::pose_converged(const Joints& position) const {
  const Eigen::Isometry3d now = kinematics::forward(arm_, position).iso * activation_.tool;
  const Eigen::Vector3d off =
      activation_.sensor.linear().transpose() * (pose_target_.translation() - now.translation());
  const Eigen::AngleAxisd turn(now.linear().transpose() * pose_target_.linear());
  const Eigen::Vector3d angles = turn.angle() * turn.axis();
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double about = deg(angles[i]);
    if (off[i] < activation_.pose_min[k] || off[i] > activation_.pose_max[k]) return false;
    if (about < activation_.pose_min[k + 3] || about > activation_.pose_max[k + 3]) return false;
  }
  return true;
}

}  // namespace weldcell::sim
