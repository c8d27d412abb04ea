#include "weldcell/geometry/plane.hpp"

#include <algorithm>
#include <cmath>

#include "weldcell/base/assert.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell {

namespace {
double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }
}  // namespace

Vec2 Pose2::rotate(const Vec2& v) const {
  const double c = std::cos(theta_rad), s = std::sin(theta_rad);
  return {c * v.x() - s * v.y(), s * v.x() + c * v.y()};
}

Vec2 Pose2::operator*(const Vec2& p) const { return rotate(p) + translation(); }

Pose2 Pose2::operator*(const Pose2& inner) const {
  const Vec2 t = (*this) * inner.translation();
  return {t.x(), t.y(), wrap_pi(theta_rad + inner.theta_rad)};
}

Pose2 Pose2::inverse() const {
  Pose2 back{0, 0, -theta_rad};
  const Vec2 t = back.rotate(-translation());
  return {t.x(), t.y(), wrap_pi(-theta_rad)};
}

Transform<Base, Part> part_on_table(const Pose2& pose, double z_table_mm) {
  Transform<Base, Part> out;
  out.iso.translate(Eigen::Vector3d(pose.x_mm, pose.y_mm, z_table_mm));
  out.iso.rotate(Eigen::AngleAxisd(pose.theta_rad, Eigen::Vector3d::UnitZ()));
  return out;
}

double distance(const Vec2& p, const Segment& s) {
  const Vec2 d = s.b - s.a;
  const double length2 = d.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - s.a).dot(d) / length2, 0.0, 1.0) : 0.0;
  return (p - s.a - t * d).norm();
}

double signed_area(const Polygon& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i)
    twice += cross(polygon[i], polygon[(i + 1) % polygon.size()]);
  return twice / 2;
}

Vec2 centroid(const Polygon& polygon) {
  WELDCELL_ASSERT(!polygon.empty());
  const double area = signed_area(polygon);
  if (std::abs(area) < 1e-12) {
    Vec2 sum = Vec2::Zero();
    for (const Vec2& p : polygon) sum += p;
    return sum / static_cast<double>(polygon.size());
  }
  Vec2 sum = Vec2::Zero();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2& a = polygon[i];
    const Vec2& b = polygon[(i + 1) % polygon.size()];
    sum += (a + b) * cross(a, b);
  }
  return sum / (6 * area);
}

bool contains(const Polygon& polygon, const Vec2& p) {
  bool inside = false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2& a = polygon[i];
    const Vec2& b = polygon[(i + 1) % polygon.size()];
    if (distance(p, Segment{a, b}) <= 1e-9) return true;
    if ((a.y() > p.y()) != (b.y() > p.y()) &&
        p.x() < (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y()) + a.x()) {
      inside = !inside;
    }
  }
  return inside;
}

Polygon transformed(const Polygon& polygon, const Pose2& pose) {
  Polygon out;
  out.reserve(polygon.size());
  for (const Vec2& p : polygon) out.push_back(pose * p);
  return out;
}

Box2 bounds(const Polygon& polygon) {
  WELDCELL_ASSERT(!polygon.empty());
  Box2 box{polygon.front(), polygon.front()};
  for (const Vec2& p : polygon) {
    box.min = box.min.cwiseMin(p);
    box.max = box.max.cwiseMax(p);
  }
  return box;
}

}  // namespace weldcell
