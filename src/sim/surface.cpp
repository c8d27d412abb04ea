#include "sim/surface.hpp"

#include <algorithm>
#include <cmath>

#include "weldcell/geometry/boxes.hpp"

namespace weldcell::sim {

namespace {
constexpr double kCell_mm = 2;
constexpr double kCastTolerance_mm = 1e-5;
constexpr double kMarch_mm = 0.1;     // steps in plan over a body that is not convex
constexpr double kSight_mm = 1e-3;    // what lies closer to a surface point than this does not hide it
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
    area_ = united(area_, body.box);
    bodies_.push_back(std::move(body));
  }
  area_ = grown(area_, reach_mm_ + kCell_mm);
  if (!bodies_.empty()) {
    columns_ = static_cast<std::size_t>((area_.max.x() - area_.min.x()) / kCell_mm) + 1;
    rows_ = static_cast<std::size_t>((area_.max.y() - area_.min.y()) / kCell_mm) + 1;
    cells_.assign(columns_ * rows_, Around::Unknown);
  }
}

double Surface::roof(const Body& body, const Vec2& inside) const {
  double rounding = body.radius_mm;
  for (const Side& side : body.sides) {
    if (side.round) rounding = std::min(rounding, std::max(0.0, side.inward.dot(inside) - side.offset));
  }
  const double r = body.radius_mm, missing = r - rounding;
  return missing <= 0 ? height_mm_ : height_mm_ - r + std::sqrt(std::max(0.0, r * r - missing * missing));
}

double Surface::height_of(const Body& body, const Vec2& p) const {
  if ((p.array() < body.box.min.array()).any() || (p.array() > body.box.max.array()).any()) return 0;
  const bool inside = body.convex ? std::all_of(body.sides.begin(), body.sides.end(),
                                                [&](const Side& s) { return s.inward.dot(p) >= s.offset; })
                                  : contains(body.outline, p);
  return inside ? roof(body, p) : 0;
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
  const double table = (table_mm_ - from.z()) / direction.z();
  const double top = std::max(0.0, (top_mm() - from.z()) / direction.z());
  double nearest = table;
  for (const Body& body : bodies_) nearest = std::min(nearest, first_hit(body, from, direction, top, table));
  return nearest;
}

double Surface::first_hit(const Body& body, const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
                          double begin, double end) const {
  const Vec2 start = from.head<2>(), way = direction.head<2>();
  const double nothing = end;
  // The part of the ray over the outline's convex hull, or over its box.
  const auto clip = [&](double inside, double rate) {
    if (std::abs(rate) < 1e-12) {
      if (inside < 0) end = begin - 1;
    } else {
      (rate > 0 ? begin = std::max(begin, -inside / rate) : end = std::min(end, -inside / rate));
    }
  };
  for (const int axis : {0, 1}) {
    clip(start[axis] - body.box.min[axis], way[axis]);
    clip(body.box.max[axis] - start[axis], -way[axis]);
  }
  for (const Side& side : body.sides) {
    if (!body.convex || begin > end) break;
    clip(side.inward.dot(start) - side.offset, side.inward.dot(way));
  }
  if (begin > end) return nothing;
  const auto above = [&](double t) {
    const Vec2 p = start + t * way;
    return from.z() + t * direction.z() - table_mm_ - (body.convex ? roof(body, p) : height_of(body, p));
  };
  const auto between = [&](double free, double blocked) {
    while (blocked - free > kCastTolerance_mm) {
      const double middle = 0.5 * (free + blocked);
      (above(middle) > 0 ? free : blocked) = middle;
    }
    return blocked;
  };
  if (above(begin) <= 1e-9) return begin;
  // Under the round edges there is nothing but the wall, which the ray has passed already.
  if (body.convex) end = std::min(end, (top_mm() - body.radius_mm - from.z()) / direction.z());
  if (above(end) <= 0 && body.convex) return between(begin, end);
  if (!body.convex) {
    const double steps = std::ceil((end - begin) * way.norm() / kMarch_mm) + 1;
    for (double i = 1, free = begin; i <= steps; ++i) {
      const double t = begin + (end - begin) * i / steps;
      if (above(t) <= 0) return between(free, t);
      free = t;
    }
    return nothing;
  }
  // The solid is convex, so that the height over it along a ray is a convex function: it may dip in between.
  double left = begin, right = end;
  while (right - left > kCastTolerance_mm) {
    const double third = (right - left) / 3, a = left + third, b = right - third;
    if (above(a) <= 0) return between(begin, a);
    (above(a) < above(b) ? right = b : left = a);
  }
  return nothing;
}

bool Surface::sees(const Eigen::Vector3d& point, const Eigen::Vector3d& eye) const {
  if (point.z() >= top_mm() || eye.z() <= point.z()) return true;
  const double distance = (point - eye).norm();
  return cast(eye, (point - eye) / distance) > distance - kSight_mm;
}

}  // namespace weldcell::sim
