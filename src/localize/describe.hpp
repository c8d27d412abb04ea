// What a fit is in the result's terms: frame Base, every point given, every member. Pure.
#pragma once

#include <span>
#include <vector>

#include "decide.hpp"

namespace weldcell::localize {

/// Fills the figures of the result. `edges` are the points as given; of them those flagged stray take no
/// part.
void describe(const Situation& situation, std::span<const EdgePoint> edges, const std::vector<bool>& stray,
              Localization& result);

}  // namespace weldcell::localize
