// The Point Cloud Library's iterative closest point as a peer of the bench; only where libpcl-dev is
// installed.
#pragma once

#include "judge.hpp"

namespace weldcell::bench {

/// False when this bench was built without PCL.
bool has_pcl();

/// pcl::IterativeClosestPoint in the plane (TransformationEstimation2D) from the planned pose: the points
/// against the outline sampled each 0.5 mm, correspondences up to 40 mm, then 20, 8 and 3 mm. It knows
/// nothing of polarity, latency or what the scan did not see; it accepts what the paper's 2.5 mm rule
/// accepts. Without PCL the answer is a rejection.
Solve pcl_icp_of(const PartUnderTest& part);

}  // namespace weldcell::bench
