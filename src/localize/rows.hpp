// One crossing against its edge, linear in pose, latency, inset and member shift: what polish and refinement
// share. Pure.
#pragma once

#include <vector>

#include "fit.hpp"
#include "normal_equations.hpp"

namespace weldcell::localize {

/// Latency before its prior is known to hold; 10 ms is the longest that a working cell shows.
inline constexpr double kWideLatency_ms = 10;

/// c, s: cosine and sine of the pose at which m was matched.
Row row_of(const TemplateFields& fields, const Crossing& crossing, const Match& m, double c, double s,
           bool inset_everywhere);

/// Applies a step in part axes.
void move(CentredPose& pose, const Common& step);

bool any_speed(const std::vector<Crossing>& crossings);

/// What a row leaves when latency, inset and the member's shift are taken off, mm.
double net_residual(const TemplateFields& fields, const Row& row, const Match& m, const FitState& state);

/// Square of the distance to the edge, which ends where it ends, mm2.
double squared_miss(double net_mm, const Match& m);

}  // namespace weldcell::localize
