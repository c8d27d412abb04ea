// The paper's own method, kept as a baseline: Powell's conjugate directions from 7 seeds over the sum of
// shortest distances, accepted when the mean error is at most 2.5 mm. Pure.
#pragma once

#include <span>

#include "weldcell/localize/localize.hpp"

namespace weldcell::localize::paper {

/// Needs at least one finite edge point. Covariance, latency and members are not part of the method and stay
/// empty.
Localization localize(const workpiece::OutlineTemplate& outline, std::span<const EdgePoint> edges,
                      const LocalizeOptions& options);

}  // namespace weldcell::localize::paper
