#include "crossings.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace weldcell::localize {

namespace {

bool usable(const EdgePoint& e) {
  return std::isfinite(e.x_mm) && std::isfinite(e.y_mm) && std::isfinite(e.dir_x) && std::isfinite(e.dir_y) &&
         std::abs(e.x_mm) < kFarthest_mm && std::abs(e.y_mm) < kFarthest_mm;
}

Crossing ready(const EdgePoint& e, int source, double default_sigma_mm) {
  Crossing out;
  out.point = {e.x_mm, e.y_mm};
  out.source = source;
  const Vec2 direction(e.dir_x, e.dir_y);
  const double length = direction.norm();
  if (length > 1e-3 && std::isfinite(length)) {
    out.direction = direction / length;
    if (e.step != 0) {
      out.inward = e.step > 0 ? out.direction : Vec2(-out.direction);
      out.inward_rad = std::atan2(out.inward.y(), out.inward.x());
      out.signed_step = true;
    }
    if (std::isfinite(e.speed_mm_s) && e.speed_mm_s > 0) out.speed_mm_s = std::min(e.speed_mm_s, 1e4);
  }
  const double sigma = std::isfinite(e.sigma_mm) && e.sigma_mm > 0 ? e.sigma_mm : default_sigma_mm;
  out.sigma_mm = std::clamp(std::isfinite(sigma) ? sigma : 0.3, kMinSigma_mm, kMaxSigma_mm);
  return out;
}

}  // namespace

Crossings ready_crossings(std::span<const EdgePoint> edges, double default_sigma_mm) {
  Crossings out;
  out.list.reserve(edges.size());
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (usable(edges[i])) {
      out.list.push_back(ready(edges[i], static_cast<int>(i), default_sigma_mm));
    } else {
      ++out.broken;
    }
  }
  // One order for any order of the same points, so that the result does not depend on it.
  const auto before = [](const Crossing& a, const Crossing& b) {
    if (a.point.x() != b.point.x()) return a.point.x() < b.point.x();
    if (a.point.y() != b.point.y()) return a.point.y() < b.point.y();
    return a.source < b.source;
  };
  std::sort(out.list.begin(), out.list.end(), before);
  const auto twice = [](const Crossing& a, const Crossing& b) { return a.point == b.point; };
  out.list.erase(std::unique(out.list.begin(), out.list.end(), twice), out.list.end());
  return out;
}

}  // namespace weldcell::localize
