// The two patterns of the beam over a workpiece, in frame Part, mm. Pure.
#pragma once

#include "weldcell/plan/scan_plan.hpp"

namespace weldcell::plan {

std::vector<BeamPath> zigzag_paths(const workpiece::Workpiece& workpiece, const Inspection& inspection);
std::vector<BeamPath> spiral_paths(const workpiece::Workpiece& workpiece, const Inspection& inspection);

}  // namespace weldcell::plan
