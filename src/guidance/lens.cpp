#include "lens.hpp"

#include <algorithm>
#include <cmath>

namespace weldcell::guidance {

namespace {
constexpr double kNearestMm = 50;   // nothing is drawn closer to the projector
constexpr double kSampleMm = 5;     // straight lines bend in the lens
constexpr double kFieldFactor = 2;  // times the picture's corner: the radial model is not asked farther out
}  // namespace

std::optional<Vec2> Lens::pixel(const Eigen::Vector3d& base_mm) const {
  const Eigen::Vector3d p = T_projector_base_.iso * base_mm;
  if (!(p.z() > kNearestMm)) return std::nullopt;
  const Vec2 n = p.head<2>() / p.z();
  const double corner = std::hypot(setup_.width_px / setup_.fx_px, setup_.height_px / setup_.fy_px) / 2;
  const double r2 = n.squaredNorm();
  if (r2 > kFieldFactor * kFieldFactor * corner * corner) return std::nullopt;
  const double bend = 1 + r2 * (setup_.k1 + r2 * setup_.k2);
  return Vec2(setup_.fx_px * bend * n.x() + setup_.cx_px, setup_.fy_px * bend * n.y() + setup_.cy_px);
}

std::vector<std::vector<Vec2>> Lens::visible(const std::vector<Vec2>& line_mm, double z_mm) const {
  std::vector<std::vector<Vec2>> pieces;
  std::optional<Vec2> before;
  const auto go_to = [&](const Vec2& mm) {
    const std::optional<Vec2> now = pixel({mm.x(), mm.y(), z_mm});
    if (before && now) {
      Vec2 a = *before, b = *now;
      if (clip(a, b, width_px(), height_px())) {
        const bool joins = !pieces.empty() && (pieces.back().back() - a).norm() < 1e-9;
        if (!joins) pieces.push_back({a});
        pieces.back().push_back(b);
      }
    }
    before = now;
  };
  for (std::size_t i = 0; i < line_mm.size(); ++i) {
    if (i == 0) {
      go_to(line_mm[0]);
      continue;
    }
    const Vec2 way = line_mm[i] - line_mm[i - 1];
    const int steps = std::max(1, static_cast<int>(std::ceil(way.norm() / kSampleMm)));
    for (int s = 1; s <= steps; ++s) go_to(line_mm[i - 1] + way * (static_cast<double>(s) / steps));
  }
  return pieces;
}

bool clip(Vec2& a, Vec2& b, double width, double height) {
  const Vec2 d = b - a;
  double from = 0, to = 1;
  // One border at a time: moving along d by t crosses it where p t = q; p < 0 enters, p > 0 leaves.
  const auto border = [&](double p, double q) {
    if (p == 0) return q >= 0;
    const double t = q / p;
    if (p < 0) from = std::max(from, t);
    if (p > 0) to = std::min(to, t);
    return from <= to;
  };
  if (!border(-d.x(), a.x()) || !border(d.x(), width - a.x()) || !border(-d.y(), a.y()) ||
      !border(d.y(), height - a.y())) {
    return false;
  }
  const Vec2 start = a;
  if (to < 1) b = start + to * d;
  if (from > 0) a = start + from * d;
  return true;
}

}  // namespace weldcell::guidance
