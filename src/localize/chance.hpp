// How likely a pose that is known as a mixture lies farther from the estimate than is bearable. Pure.
#pragma once

#include <vector>

#include "fit.hpp"

namespace weldcell::localize {

/// Probability that the shift is longer than most_mm or the turn larger than most_rad, 0..1. Shift and turn
/// count as independent within each chance, which overstates it a little. 1 for no chance at all.
double chance_beyond(const std::vector<Chance>& chances, double most_mm, double most_rad);

}  // namespace weldcell::localize
