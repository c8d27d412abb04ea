// A member's long axis, from its outline. Pure.
#pragma once

#include "weldcell/workpiece/workpiece.hpp"

namespace weldcell::guidance {

/// The line through the centroid along the longest side, from end to end of the outline; frame Part.
Segment centre_line(const workpiece::Member& member);

}  // namespace weldcell::guidance
