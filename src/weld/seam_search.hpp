// Ways for the arm along one seam: roll about the wire and branch, found as a ladder graph over stations.
// Pure.
#pragma once

#include <string>
#include <vector>

#include "weldcell/cell/cell_setup.hpp"
#include "weldcell/weld/rapid.hpp"

namespace weldcell::weld {

/// A seam as the torch sees it: tips at most 2 mm apart and the direction of travel at each, Base.
struct SeamLine {
  std::string name;
  std::vector<Eigen::Vector3d> tips;
  std::vector<Eigen::Vector3d> travel;
  double work_angle_rad = 0, travel_angle_rad = 0;
  bool straight = true;
};

/// Directions are taken over 10 mm to either side, so that a corner turns the torch over a stretch and not at
/// a point.
SeamLine seam_line(const workpiece::Weld& weld, const std::vector<Eigen::Vector3d>& path);

/// One way to weld the seam: joints at over, approach, every tip, retract, away; all of one branch.
struct SeamWay {
  std::vector<TorchTarget> targets;
  std::size_t first_seam = 0, last_seam = 0;
  double cost = 0;
};

struct SeamSearch {
  const cell::CellSetup& cell;
  double top_z_mm;                      ///< of the members, Base
  std::vector<double> over_heights_mm;  ///< heights of the over and away points above the members to try
};

/// Ways in order of cost, at least one; else "weld.unreachable".
Result<std::vector<SeamWay>> seam_ways(const SeamSearch& search, const SeamLine& seam,
                                       const kinematics::Joints& near);

/// Lowest of torch tip, laser, projector and flange at these joints, Base z, mm.
double lowest_tool_mm(const cell::CellSetup& cell, const kinematics::Joints& joints);

}  // namespace weldcell::weld
