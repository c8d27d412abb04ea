// What the scan did not look at: departures from the drawing that it would not have shown. Pure.
#pragma once

#include <string>
#include <vector>

#include "alternatives.hpp"
#include "decide.hpp"
#include "weldcell/workpiece/departures.hpp"

namespace weldcell::localize {

/// A departure that points and travel do not speak against, and the pass that would settle it.
struct Unproven {
  workpiece::Departure departure;
  Segment pass;  ///< frame Part
};

/// Departures by options.prove_shift_mm of each member from where the fit has it that points and travel do
/// not refute by kRefuted_nats. Those that nobody can see from above are none. Ends first, then in the order
/// of members. Needs a path.
std::vector<Unproven> unproven(const Situation& situation, const Alternatives& alternatives);

/// "upper end of rung_3", "left side of rail_L", "direction of rung_3" - as on the drawing.
std::string place_name(const workpiece::OutlineTemplate& outline, const workpiece::Departure& departure);

/// A part that departs so is let through about once in so many e-folds: 4 nats are 2 % of those parts.
inline constexpr double kRefuted_nats = 4;

}  // namespace weldcell::localize
