// Tool poses that planning asks the arm for, and how well its branches hold them. Pure.
#pragma once

#include <array>

#include "weldcell/cell/cell_setup.hpp"

namespace weldcell::plan {

/// One figure a branch of the arm; -1 where it cannot hold the pose.
using BranchScores = std::array<double, kinematics::Branches::kCount>;

/// Rotation whose Z is `pointing` (unit) and whose X lies at roll_rad from a fixed direction across it; for a
/// tool that looks straight down roll 0 puts X along Base X, counted counter-clockwise seen from above.
Eigen::Matrix3d tool_rotation(const Eigen::Vector3d& pointing, double roll_rad);

/// Raises each branch's score to its dexterity at this flange pose, turns of J4 and J6 chosen near `near`.
void raise_scores(const cell::CellSetup& cell, const Transform<Base, Flange>& flange,
                  const kinematics::Joints& near, BranchScores& scores);

}  // namespace weldcell::plan
