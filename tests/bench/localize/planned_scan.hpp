// The beam's travel as the product plans it for a part that lies at its planned place. Pure.
#pragma once

#include <vector>

#include "weldcell/geometry/edge_point.hpp"
#include "weldcell/workpiece/workpiece.hpp"

namespace weldcell::bench {

/// The measured lines of the zigzag with its defaults, frame Base at planned pose zero.
std::vector<PathPiece> planned_scan(const workpiece::Workpiece& workpiece);

/// Length of the passes over members' ends as a share of all other passes of that zigzag.
double end_pass_share(const workpiece::Workpiece& workpiece);

}  // namespace weldcell::bench
