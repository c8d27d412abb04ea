#include "strays.hpp"

#include <algorithm>
#include <cmath>

namespace weldcell::localize {

namespace {

/// Sideways: sigmas of the point, and what a path made of straight pieces leaves out.
constexpr double kSigmas = 4.5;
constexpr double kCurved_mm = 0.3;
constexpr double kLeastAside_mm = 1;
constexpr double kAlong_mm = 25;
/// Cosine between a point's direction and the piece's.
constexpr double kSameWay = 0.8;

struct Straight {
  Vec2 from, direction;
  double length;
};

std::vector<Straight> straights(std::span<const PathPiece> path) {
  std::vector<Straight> out;
  out.reserve(path.size());
  for (const PathPiece& p : path) {
    const Vec2 from(p.x0_mm, p.y0_mm), by(p.x1_mm - p.x0_mm, p.y1_mm - p.y0_mm);
    const double length = by.norm();
    if (length > 1e-9) out.push_back({from, by / length, length});
  }
  return out;
}

bool passes(const Straight& s, const Crossing& c, double aside) {
  const Vec2 by = c.point - s.from;
  if (std::abs(s.direction.x() * by.y() - s.direction.y() * by.x()) > aside) return false;
  const double along = s.direction.dot(by);
  return along > -kAlong_mm && along < s.length + kAlong_mm &&
         std::abs(s.direction.dot(c.direction)) >= kSameWay * c.direction.norm();
}

}  // namespace

void drop_strays(std::span<const PathPiece> path, std::size_t edge_points, Crossings& crossings) {
  const std::vector<Straight> pieces = straights(path);
  if (pieces.empty()) return;
  std::vector<int> at_source(edge_points, -1);
  for (std::size_t i = 0; i < crossings.list.size(); ++i)
    at_source[static_cast<std::size_t>(crossings.list[i].source)] = static_cast<int>(i);
  crossings.stray.assign(edge_points, false);
  // Points mostly come in the order of the travel: the piece of the last one is asked first.
  std::size_t last = 0;
  for (std::size_t source = 0; source < edge_points; ++source) {
    if (at_source[source] < 0) continue;
    const Crossing& c = crossings.list[static_cast<std::size_t>(at_source[source])];
    const double aside = std::max(kLeastAside_mm, kSigmas * c.sigma_mm + kCurved_mm);
    std::size_t tried = 0;
    while (tried < pieces.size() && !passes(pieces[(last + tried) % pieces.size()], c, aside)) ++tried;
    crossings.stray[source] = tried == pieces.size();
    last = (last + tried) % pieces.size();
  }
  std::erase_if(crossings.list,
                [&](const Crossing& c) { return crossings.stray[static_cast<std::size_t>(c.source)]; });
}

}  // namespace weldcell::localize
