// Shifts by which an outline nearly covers itself: rungs or pickets side by side at nearly one pitch. Pure.
#pragma once

#include <vector>

#include "crossings.hpp"
#include "fields.hpp"

namespace weldcell::localize {

/// The shortest such shift of each direction (its opposite and its multiples are not repeated), mm, frame
/// Part. Only those too short for a search with distinct modes to tell apart: kShortestSlip_mm to
/// kLongestSlip_mm.
std::vector<Vec2> slips_of(const TemplateFields& fields);

/// An even sample of at most `count`, half of it from the crossings across the direction that most of them
/// face: of a part of many rungs few points lie on the rails, and they alone tell where it lies along the
/// rungs.
std::vector<Crossing> sampled_both_ways(const std::vector<Crossing>& crossings, std::size_t count);

inline constexpr double kShortestSlip_mm = 6, kLongestSlip_mm = 45;

}  // namespace weldcell::localize
