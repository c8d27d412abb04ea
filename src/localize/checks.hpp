// What no pose can be had from, told before anything is searched. Pure.
#pragma once

#include <string>
#include <vector>

#include "crossings.hpp"
#include "weldcell/localize/localize.hpp"

namespace weldcell::localize {

/// A result without a pose, over so many points.
Localization refused(Verdict verdict, const char* cause, std::string reason, std::size_t points);

/// The first option that is no sensible number, with its value and its limits; empty when all are sound.
std::string wrong_option(const LocalizeOptions& options);

/// Whether all points lie at one spot or along the line between two that are about the farthest apart; at
/// least one point.
bool on_one_line(const std::vector<Crossing>& crossings);

/// Whether the piece is finite and within kFarthest_mm of Base.
bool sound(const PathPiece& piece);

}  // namespace weldcell::localize
