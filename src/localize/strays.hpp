// Points that the beam cannot have seen where they are said to lie. Pure.
#pragma once

#include <span>

#include "crossings.hpp"

namespace weldcell::localize {

/// Takes out of the list, and flags, what lies beside every piece of the travel by more than its sigma
/// explains, or where the beam went along another line. Along the travel, where latency, shadows and trimmed
/// pieces leave room, 25 mm before and behind a piece count as travelled. Directions are compared where the
/// point has one.
void drop_strays(std::span<const PathPiece> path, std::size_t edge_points, Crossings& crossings);

}  // namespace weldcell::localize
