// Plane geometry in millimetres: points, segments, polygons and the rigid pose of a part on the table. Pure.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "weldcell/geometry/transform.hpp"

namespace weldcell {

using Vec2 = Eigen::Vector2d;

/// Pose of a plane frame in another: p_to = R(theta) p_from + (x, y). mm, rad (counter-clockwise seen from
/// +Z).
struct Pose2 {
  double x_mm = 0;
  double y_mm = 0;
  double theta_rad = 0;

  Vec2 operator*(const Vec2& p) const;
  Pose2 operator*(const Pose2& inner) const;  ///< theta of the product is wrapped to (-pi, pi]
  Pose2 inverse() const;
  Vec2 translation() const { return {x_mm, y_mm}; }
  Vec2 rotate(const Vec2& v) const;
};

/// The part's pose as a spatial transform, its frame lying on the table at z_table_mm in Base.
Transform<Base, Part> part_on_table(const Pose2& pose, double z_table_mm);

struct Segment {
  Vec2 a = Vec2::Zero();
  Vec2 b = Vec2::Zero();
  double length() const { return (b - a).norm(); }
  Vec2 direction() const { return (b - a).normalized(); }
};

/// Closest distance from p to the segment, mm.
double distance(const Vec2& p, const Segment& s);

/// A closed polygon, last vertex joined to the first. Counter-clockwise is positive area.
using Polygon = std::vector<Vec2>;

double signed_area(const Polygon& polygon);
Vec2 centroid(const Polygon& polygon);
/// Whether p is inside or on the boundary (within 1e-9 mm).
bool contains(const Polygon& polygon, const Vec2& p);
Polygon transformed(const Polygon& polygon, const Pose2& pose);

struct Box2 {
  Vec2 min = Vec2::Zero();
  Vec2 max = Vec2::Zero();
};
/// Bounding box; the polygon must not be empty.
Box2 bounds(const Polygon& polygon);

}  // namespace weldcell
