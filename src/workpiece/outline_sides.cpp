#include "outline_sides.hpp"

#include <algorithm>

namespace weldcell::workpiece {

Side side_of(const Polygon& outline, std::size_t k) {
  const Segment s{outline[k % outline.size()], outline[(k + 1) % outline.size()]};
  const Vec2 d = s.direction();
  return {s.a, s.b, d, {d.y(), -d.x()}, s.length()};
}

Vec2 longest_direction(const Polygon& outline) {
  Side best = side_of(outline, 0);
  for (std::size_t k = 1; k < outline.size(); ++k) {
    const Side s = side_of(outline, k);
    if (s.length > best.length * (1 + 1e-9)) best = s;
  }
  return best.d;
}

Extent extent(const Polygon& outline, const Vec2& axis) {
  Extent out{axis.dot(outline.front()), axis.dot(outline.front())};
  for (const Vec2& p : outline) {
    out.low = std::min(out.low, axis.dot(p));
    out.high = std::max(out.high, axis.dot(p));
  }
  return out;
}

Polygon shifted(const Polygon& outline, const Vec2& by) {
  Polygon out = outline;
  for (Vec2& p : out) p += by;
  return out;
}

}  // namespace weldcell::workpiece
