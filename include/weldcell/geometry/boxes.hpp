// Boxes along the axes: what lies near what. Any one unit. Pure.
#pragma once

#include <cmath>

#include "weldcell/geometry/plane.hpp"

namespace weldcell {

inline Box2 grown(const Box2& box, double by) {
  return {Vec2(box.min.array() - by), Vec2(box.max.array() + by)};
}

/// The smallest box that holds both.
inline Box2 united(const Box2& a, const Box2& b) { return {a.min.cwiseMin(b.min), a.max.cwiseMax(b.max)}; }

/// What both boxes hold; max < min when that is nothing.
inline Box2 intersection(const Box2& a, const Box2& b) {
  return {a.min.cwiseMax(b.min), a.max.cwiseMin(b.max)};
}

/// Boxes that touch are not apart.
inline bool apart(const Box2& a, const Box2& b) {
  return (a.min.array() > b.max.array()).any() || (b.min.array() > a.max.array()).any();
}

inline bool contains(const Box2& box, const Vec2& p) {
  return (p.array() >= box.min.array()).all() && (p.array() <= box.max.array()).all();
}

/// About a segment.
inline Box2 bounds(const Segment& s) { return {s.a.cwiseMin(s.b), s.a.cwiseMax(s.b)}; }

/// Whether any of the segment lies in the box (rounding counts as within).
inline bool meets(const Segment& s, const Box2& box) {
  if (apart(bounds(s), box)) return false;
  // No axis tells them apart, then, but the segment's normal may.
  const Vec2 d = s.b - s.a, half = (box.max - box.min) / 2, from = box.min + half - s.a;
  const double reach = half.x() * std::abs(d.y()) + half.y() * std::abs(d.x());
  return std::abs(d.x() * from.y() - d.y() * from.x()) <= reach + 1e-9 * d.squaredNorm();
}

}  // namespace weldcell
