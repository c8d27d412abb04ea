#include "sim/surface.hpp"

#include <algorithm>
#include <cmath>

namespace weldcell::sim {

namespace {
constexpr double kCell_mm = 2;
constexpr double kAlongMember = 0.9;  // |cos| to the member's longest side: a long side, not an end
}  // namespace

std::vector<Polygon> placed_members(const Scene& scene) {
  std::vector<Polygon> out;
  for (std::size_t i = 0; i < scene.workpiece.members.size(); ++i) {
    const Polygon& outline = scene.workpiece.members[i].outline;
    const MemberTruth off = i < scene.members.size() ? scene.members[i] : MemberTruth{};
    if (off.missing) {
      out.emplace_back();
      continue;
    }
    // A member turns about its own centroid.
    const Vec2 c = centroid(outline);
    const Pose2 turn{0, 0, off.dtheta_rad};
    const Vec2 shift = c + Vec2(off.dx_mm, off.dy_mm) - turn.rotate(c);
    out.push_back(transformed(outline, scene.truth * Pose2{shift.x(), shift.y(), off.dtheta_rad}));
  }
  return out;
}

Surface::Surface(const Scene& scene, double reach_mm)
    : table_mm_(scene.cell.setup.table.z_mm), height_mm_(scene.workpiece.height_mm), reach_mm_(reach_mm) {
  const std::vector<Polygon> outlines = placed_members(scene);
  for (std::size_t i = 0; i < outlines.size(); ++i) {
    if (outlines[i].empty()) continue;
    Body body;
    body.outline = outlines[i];
    if (signed_area(body.outline) < 0) std::reverse(body.outline.begin(), body.outline.end());
    body.box = bounds(body.outline);
    body.radius_mm = std::min(scene.workpiece.members[i].edge_radius_mm, height_mm_);
    roundest_mm_ = std::max(roundest_mm_, body.radius_mm);
    const std::size_t n = body.outline.size();
    Vec2 longest = Vec2::Zero();
    for (std::size_t k = 0; k < n; ++k) {
      const Vec2 side = body.outline[(k + 1) % n] - body.outline[k];
      if (side.norm() > longest.norm()) longest = side;
    }
    for (std::size_t k = 0; k < n; ++k) {
      const Vec2 a = body.outline[k], along = (body.outline[(k + 1) % n] - a).normalized();
      Side side;
      side.inward = Vec2(-along.y(), along.x());
      side.offset = side.inward.dot(a);
      side.round = body.radius_mm > 0 && std::abs(along.dot(longest.normalized())) > kAlongMember;
      body.sides.push_back(side);
    }
    for (const Vec2& p : body.outline) {
      for (const Side& side : body.sides)
        body.convex = body.convex && side.inward.dot(p) - side.offset > -1e-6;
    }
    if (bodies_.empty()) area_ = body.box;
    area_.min = area_.min.cwiseMin(body.box.min);
    area_.max = area_.max.cwiseMax(body.box.max);
    bodies_.push_back(std::move(body));
  }
  const Vec2 border = Vec2::Constant(reach_mm_ + kCell_mm);
  area_.min -= border;
  area_.max += border;
  if (!bodies_.empty()) {
    columns_ = static_cast<std::size_t>((area_.max.x() - area_.min.x()) / kCell_mm) + 1;
    rows_ = static_cast<std::size_t>((area_.max.y() - area_.min.y()) / kCell_mm) + 1;
    cells_.assign(columns_ * rows_, Around::Unknown);
  }
}

double Surface::height_of(const Body& body, const Vec2& p) const {
  if ((p.array() < body.box.min.array()).any() || (p.array() > body.box.max.array()).any()) return 0;
  if (!body.convex && !contains(body.outline, p)) return 0;
  double rounding = body.radius_mm;
  for (const Side& side : body.sides) {
    const double inside = side.inward.dot(p) - side.offset;
    if (body.convex && inside < 0) return 0;
    if (side.round && inside >= 0) rounding = std::min(rounding, inside);
  }
  const double r = body.radius_mm, missing = r - rounding;
  return missing <= 0 ? height_mm_ : height_mm_ - r + std::sqrt(std::max(0.0, r * r - missing * missing));
}

double Surface::height(double x_mm, double y_mm) const {
  const Vec2 p(x_mm, y_mm);
  double out = 0;
  for (const Body& body : bodies_) out = std::max(out, height_of(body, p));
  return out;
}

Surface::Around Surface::classify(const Vec2& center) const {
  const double cell = kCell_mm * 0.7072;
  const double here = height(center.x(), center.y());
  const bool top = here >= height_mm_;
  if (here > 0 && !top) return Around::Edge;
  for (const Body& body : bodies_) {
    const double reach = cell + reach_mm_ + body.radius_mm;
    if (center.x() < body.box.min.x() - reach || center.x() > body.box.max.x() + reach ||
        center.y() < body.box.min.y() - reach || center.y() > body.box.max.y() + reach) {
      continue;
    }
    const double clear = top ? reach : reach - body.radius_mm;
    for (std::size_t k = 0; k < body.outline.size(); ++k) {
      const Segment side{body.outline[k], body.outline[(k + 1) % body.outline.size()]};
      if (distance(center, side) < clear) return Around::Edge;
    }
  }
  return top ? Around::Top : Around::Table;
}

Surface::Around Surface::around(double x_mm, double y_mm) {
  if (x_mm < area_.min.x() || y_mm < area_.min.y() || cells_.empty()) return Around::Table;
  const auto column = static_cast<std::size_t>((x_mm - area_.min.x()) / kCell_mm);
  const auto row = static_cast<std::size_t>((y_mm - area_.min.y()) / kCell_mm);
  if (column >= columns_ || row >= rows_) return Around::Table;
  Around& cell = cells_[row * columns_ + column];
  if (cell == Around::Unknown) {
    cell = classify(area_.min +
                    kCell_mm * Vec2(static_cast<double>(column) + 0.5, static_cast<double>(row) + 0.5));
  }
  return cell;
}

double Surface::cast(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) const {
  if (direction.z() > -0.05) return -1;
  const double top = (from.z() - top_mm()) / -direction.z(), table = (from.z() - table_mm_) / -direction.z();
  const auto above = [&](double t) {
    return from.z() + t * direction.z() - table_mm_ -
           height(from.x() + t * direction.x(), from.y() + t * direction.y());
  };
  if (above(top) <= 1e-9) return top;
  const double at_table = height(from.x() + table * direction.x(), from.y() + table * direction.y());
  if (at_table <= 0 && std::abs(above((top + table) / 2) - height_mm_ / 2) < 1e-9) return table;
  // Between the planes: a round edge, or a side wall met by a tilted beam. One that leaves the outline
  // downwards meets the round edge or passes it and then meets nothing, so that each is looked for by itself.
  const double walls = top + roundest_mm_ / -direction.z();
  double free = top, blocked = table;
  if (above(walls) <= 0) {
    blocked = walls;
  } else if (at_table <= 0) {
    return table;
  } else {
    free = walls;
  }
  for (int i = 0; i < 24; ++i) {
    const double middle = 0.5 * (free + blocked);
    (above(middle) > 0 ? free : blocked) = middle;
  }
  return blocked;
}

bool Surface::sees(const Eigen::Vector3d& point, const Eigen::Vector3d& eye) const {
  const double to_top = top_mm() - point.z();
  if (to_top <= 0 || eye.z() <= point.z()) return true;
  const Vec2 from = point.head<2>();
  const Vec2 way = (eye - point).head<2>() * (to_top / (eye.z() - point.z()));
  for (const Body& body : bodies_) {
    // The part of the way, from the point up to the height of the tops, that lies over this body.
    double in = 0, out = 1;
    for (const Side& side : body.sides) {
      if (!body.convex) break;
      const double at = side.inward.dot(from) - side.offset, rate = side.inward.dot(way);
      if (std::abs(rate) < 1e-12) {
        if (at < 0) in = 2;
      } else if (rate > 0) {
        in = std::max(in, -at / rate);
      } else {
        out = std::min(out, -at / rate);
      }
    }
    if (in >= out - 1e-9) continue;
    if (body.convex && body.radius_mm == 0) return false;
    constexpr int kSteps = 8;
    for (int i = 1; i <= kSteps; ++i) {
      const double t = in + (out - in) * (i - 0.5) / kSteps;
      if (height_of(body, from + t * way) > point.z() - table_mm_ + t * to_top + 1e-6) return false;
    }
  }
  return true;
}

}  // namespace weldcell::sim
