// Boxes about what lies near one another. mm. Pure.
#pragma once

#include <cmath>

#include "weldcell/geometry/plane.hpp"

namespace weldcell::localize {

inline Box2 grown(const Box2& box, double by_mm) {
  return {Vec2(box.min.array() - by_mm), Vec2(box.max.array() + by_mm)};
}

/// What both boxes hold; max < min when that is nothing.
inline Box2 intersection(const Box2& a, const Box2& b) {
  return {a.min.cwiseMax(b.min), a.max.cwiseMin(b.max)};
}

/// Boxes that touch are not apart.
inline bool apart(const Box2& a, const Box2& b) {
  return (a.min.array() > b.max.array()).any() || (b.min.array() > a.max.array()).any();
}

using weldcell::contains;
inline bool contains(const Box2& box, const Vec2& p) {
  return (p.array() >= box.min.array()).all() && (p.array() <= box.max.array()).all();
}

/// Whether any of the segment lies in the box (rounding counts as within).
inline bool meets(const Segment& s, const Box2& box) {
  if (apart({s.a.cwiseMin(s.b), s.a.cwiseMax(s.b)}, box)) return false;
  // No axis tells them apart, then, but the segment's normal may.
  const Vec2 d = s.b - s.a, half = (box.max - box.min) / 2, from = box.min + half - s.a;
  const double reach = half.x() * std::abs(d.y()) + half.y() * std::abs(d.x());
  return std::abs(d.x() * from.y() - d.y() * from.x()) <= reach + 1e-9 * d.squaredNorm();
}

}  // namespace weldcell::localize
