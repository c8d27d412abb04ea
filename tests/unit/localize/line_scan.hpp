// Members of four corners, and what a scan along given lines sees of a part. Seeded.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "weldcell/geometry/edge_point.hpp"
#include "weldcell/workpiece/outline_template.hpp"

namespace weldcell::localize {

inline workpiece::Member box(const std::string& name, const Vec2& low, const Vec2& high) {
  workpiece::Member out;
  out.name = out.tag = name;
  out.outline = {low, {high.x(), low.y()}, high, {low.x(), high.y()}};
  return out;
}

struct Scan {
  std::vector<EdgePoint> edges;
  std::vector<PathPiece> path;
};

/// What lies there along these lines, 0.2 mm noise, no clutter.
inline void scan(const workpiece::OutlineTemplate& part, const std::vector<PathPiece>& path,
                 std::uint64_t seed, Scan& out) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, 0.2);
  for (const PathPiece& p : path) {
    const Vec2 from(p.x0_mm, p.y0_mm), end(p.x1_mm, p.y1_mm), travel = (end - from).normalized();
    for (const workpiece::VisibleEdge& e : part.edges) {
      const double a = (from - e.line.a).dot(e.outward), b = (end - e.line.a).dot(e.outward);
      if ((a < 0) == (b < 0)) continue;
      const Vec2 at = from + a / (a - b) * (end - from);
      if (distance(at, e.line) > 1e-6) continue;
      out.edges.push_back({at.x() + noise(random), at.y() + noise(random), travel.x(), travel.y(),
                           travel.dot(e.outward) < 0 ? 1 : -1, 0.2, 200, false});
    }
  }
  out.path.insert(out.path.end(), path.begin(), path.end());
}

}  // namespace weldcell::localize
