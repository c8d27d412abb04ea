// The paper's own method, kept as a baseline: Powell's conjugate directions from 7 seeds over the sum of
// shortest distances, accepted when the mean error is at most 2.5 mm. Pure.
#pragma once

#include <cstddef>
#include <vector>

#include "crossings.hpp"
#include "weldcell/localize/localize.hpp"

namespace weldcell::localize::paper {

/// Needs at least one crossing; point_count is the number of edge points that they come from. Covariance,
/// latency and members are not part of the method and stay empty.
Localization localize(const workpiece::OutlineTemplate& outline, const std::vector<Crossing>& crossings,
                      std::size_t point_count, const LocalizeOptions& options);

}  // namespace weldcell::localize::paper
