#include "poses.hpp"

#include <algorithm>
#include <cmath>

namespace weldcell::plan {

Eigen::Matrix3d tool_rotation(const Eigen::Vector3d& pointing, double roll_rad) {
  // Carry the straight-down frame over by the shortest turn, so that the roll means the same for small tilts.
  const Eigen::Quaterniond tilt = Eigen::Quaterniond::FromTwoVectors(-Eigen::Vector3d::UnitZ(), pointing);
  const double c = std::cos(roll_rad), s = std::sin(roll_rad);
  Eigen::Matrix3d down;
  down << c, s, 0, s, -c, 0, 0, 0, -1;
  return tilt.toRotationMatrix() * down;
}

void raise_scores(const cell::CellSetup& cell, const Transform<Base, Flange>& flange,
                  const kinematics::Joints& near, BranchScores& scores) {
  kinematics::Branches branches;
  kinematics::inverse_branches(cell.arm, flange, near, branches);
  for (std::size_t b = 0; b < scores.size(); ++b) {
    if (!branches.valid[b]) continue;
    kinematics::Joints q = branches.joints[b];
    if (!kinematics::nearest_turns(cell.arm, near, cell.limits.limit_margin_rad, q)) continue;
    if (std::abs(std::sin(q[4])) < cell.limits.min_sin_j5) continue;
    scores[b] = std::max(scores[b], kinematics::dexterity(cell.arm, q));
  }
}

}  // namespace weldcell::plan
