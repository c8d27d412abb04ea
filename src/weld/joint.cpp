#include "joint.hpp"

#include <algorithm>
#include <cmath>

namespace weldcell::weld {

namespace {

constexpr double kFacingCosine = -0.985;  // sides within 10 deg of facing each other
constexpr double kShortestContactMm = 0.5;

Vec2 outward(const Segment& side) {
  const Vec2 d = side.direction();
  return {d.y(), -d.x()};
}

}  // namespace

std::optional<Contact> contact(const workpiece::Member& first, const workpiece::Member& second,
                               const Vec2& near, double reach_mm) {
  std::optional<Contact> best;
  double best_distance = 0;
  const Polygon& a = first.outline;
  const Polygon& b = second.outline;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Segment side{a[i], a[(i + 1) % a.size()]};
    if (side.length() < kShortestContactMm) continue;
    const Vec2 normal = outward(side), along = side.direction();
    for (std::size_t k = 0; k < b.size(); ++k) {
      const Segment other{b[k], b[(k + 1) % b.size()]};
      if (other.length() < kShortestContactMm || normal.dot(outward(other)) > kFacingCosine) continue;
      const Vec2 middle = (other.a + other.b) / 2;
      if (std::abs(normal.dot(middle - side.a)) > reach_mm) continue;
      const double p = along.dot(other.a - side.a), q = along.dot(other.b - side.a);
      const double from = std::max(0.0, std::min(p, q)), to = std::min(side.length(), std::max(p, q));
      if (to - from < kShortestContactMm) continue;
      const Contact found{normal, {side.a + from * along, side.a + to * along}};
      const double d = distance(near, found.line);
      if (!best || d < best_distance) {
        best = found;
        best_distance = d;
      }
    }
  }
  return best;
}

}  // namespace weldcell::weld
