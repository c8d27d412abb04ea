// Which way round the receiver looks on each path: either of two opposite sides, in whichever turn of the
// wrist fits. Pure.
#pragma once

#include "beam_arm.hpp"
#include "weldcell/plan/scan_plan.hpp"

namespace weldcell::plan {

struct ReceiverChoice {
  std::vector<double> angles_rad;  ///< one a path, unwrapped: the wrist turns by their differences
  kinematics::Joints at_first{};   ///< joints at the first path's first point
};

/// Least turning of the receiver and most room for the arm over all paths together. Error "plan.unreachable".
Result<ReceiverChoice> choose_receiver_angles(const BeamArm& arm, const std::vector<BeamPath>& paths,
                                              const kinematics::Joints& near);

}  // namespace weldcell::plan
