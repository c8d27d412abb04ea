// Sides and extents of a member's outline, and copies of it elsewhere. Pure.
#pragma once

#include "weldcell/geometry/plane.hpp"

namespace weldcell::workpiece {

/// |travel . normal| below which a crossing may be missed.
inline constexpr double kMinAcross = 0.35;

struct Side {
  Vec2 a, b, d, n;  ///< from, to, unit direction, outward normal
  double length;
};
/// The side from vertex k to the next; k may be beyond the last.
Side side_of(const Polygon& outline, std::size_t k);

/// Of the longest side.
Vec2 longest_direction(const Polygon& outline);

struct Extent {
  double low, high;
  double size() const { return high - low; }
  double middle() const { return (low + high) / 2; }
};
Extent extent(const Polygon& outline, const Vec2& axis);

Polygon shifted(const Polygon& outline, const Vec2& by);

}  // namespace weldcell::workpiece
