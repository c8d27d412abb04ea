// The weldments of the localization bench: six that thresholds were tuned on, eight that they were not, and
// the wrong parts that may lie in their place. Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "weldcell/workpiece/workpiece.hpp"

namespace weldcell::bench {

/// A straight bar of the given width about the line from -> to; its ends are square. mm, frame Part.
workpiece::Member bar(const std::string& name, const Vec2& from, const Vec2& to, double width_mm);

/// Ladder, rectangle, nearly symmetric frame, mitred frame, A-frame and a corner of three members.
std::vector<workpiece::Workpiece> known_weldments();

/// Gate with a brace, trapezoid with a post, tee, ell, grid of twelve, scalene triangle, fence with pickets
/// at one pitch, and a ladder of round-edged tubes.
std::vector<workpiece::Workpiece> unseen_weldments();

/// Two rails and `rungs` rungs at uneven places: for growth with the number of members.
workpiece::Workpiece comb(int rungs);

/// What lies on the table instead of the part of the drawing.
enum class Wrong : std::uint8_t { Mirrored, Moved, Missing, Swapped, Lengthened };
const char* to_string(Wrong);

struct Altered {
  workpiece::Workpiece part;
  std::string what;  ///< "post moved by -20 mm in x"
};
/// Mirrored: the mirror image. Moved: one member by 20 mm along x or y. Missing: one member less. Swapped:
/// two members of unlike outlines have changed places, each about its own centroid. Lengthened: one member is
/// 20 mm longer at one end. `pick` chooses members and signs; nothing when no choice makes such a part.
std::optional<Altered> altered(const workpiece::Workpiece& drawing, Wrong how, std::uint64_t pick);

}  // namespace weldcell::bench
