#include <algorithm>
#include <cmath>

#include "cad/dxf_drawing.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::cad {

namespace {
constexpr double kStepRad = 0.035;  ///< 2 deg: 0.015 mm off the arc at a radius of 100 mm
}

std::vector<Vec2> arc_points(const Vec2& c, double radius, double a0, double a1) {
  const int steps = std::clamp(static_cast<int>(std::ceil(std::abs(a1 - a0) / kStepRad)), 1, 400);
  std::vector<Vec2> out;
  for (int i = 0; i <= steps; ++i) {
    const double a = a0 + (a1 - a0) * i / steps;
    out.emplace_back(c.x() + radius * std::cos(a), c.y() + radius * std::sin(a));
  }
  return out;
}

std::vector<Vec2> bulge_points(const Vec2& from, const Vec2& to, double bulge) {
  const Vec2 chord = to - from;
  if (std::abs(bulge) < 1e-9 || chord.norm() < 1e-12) return {to};
  const double angle = 4 * std::atan(bulge);
  const double radius = chord.norm() / (2 * std::sin(std::abs(angle) / 2));
  const Vec2 left(-chord.y(), chord.x());
  // Signed distance from the chord's middle to the centre, to the left for bulges below a half circle.
  const Vec2 c = (from + to) / 2 + left * ((1 - bulge * bulge) / (4 * bulge));
  const double a0 = std::atan2(from.y() - c.y(), from.x() - c.x());
  std::vector<Vec2> out = arc_points(c, radius, a0, a0 + angle);
  out.erase(out.begin());
  out.back() = to;
  return out;
}

std::vector<Vec2> spline_points(int degree, const std::vector<double>& knots,
                                const std::vector<Vec2>& control, const std::vector<double>& weights) {
  const std::size_t p = static_cast<std::size_t>(std::max(degree, 0)), n = control.size();
  if (p < 1 || p > 25 || n < p + 1 || knots.size() != n + p + 1 || weights.size() != n) return {};
  if (!std::is_sorted(knots.begin(), knots.end())) return {};
  std::vector<Vec2> out;
  // De Boor's algorithm in homogeneous coordinates, a fixed number of points in each knot span.
  const auto at = [&](std::size_t span, double t) {
    std::vector<Eigen::Vector3d> d(p + 1);
    for (std::size_t j = 0; j <= p; ++j) {
      const std::size_t i = j + span - p;
      d[j] = {control[i].x() * weights[i], control[i].y() * weights[i], weights[i]};
    }
    for (std::size_t r = 1; r <= p; ++r) {
      for (std::size_t j = p; j >= r; --j) {
        const double k0 = knots[j + span - p], k1 = knots[j + 1 + span - r];
        const double alpha = k1 > k0 ? (t - k0) / (k1 - k0) : 0;
        d[j] = (1 - alpha) * d[j - 1] + alpha * d[j];
      }
    }
    return Vec2(d[p].head<2>() / d[p].z());
  };
  constexpr int kPerSpan = 12;
  for (std::size_t span = p; span < n; ++span) {
    if (knots[span + 1] <= knots[span]) continue;
    for (int i = out.empty() ? 0 : 1; i <= kPerSpan; ++i) {
      out.push_back(at(span, knots[span] + (knots[span + 1] - knots[span]) * i / kPerSpan));
    }
  }
  return out;
}

}  // namespace weldcell::cad
