// The table with the members as they really lie: height over every point, and where a ray meets it. Pure.
#pragma once

#include <cstdint>
#include <vector>

#include "weldcell/geometry/plane.hpp"
#include "weldcell/sim/scene.hpp"

namespace weldcell::sim {

/// Outline of each member in Base as it really lies; missing members have an empty one.
std::vector<Polygon> placed_members(const Scene& scene);

class Surface {
 public:
  /// reach_mm: how close to an edge around() says Edge.
  Surface(const Scene& scene, double reach_mm);

  double table_mm() const { return table_mm_; }
  double top_mm() const { return table_mm_ + height_mm_; }

  /// Height above the table at a point of Base, round edges included.
  double height(double x_mm, double y_mm) const;

  enum class Around : std::uint8_t { Unknown, Table, Top, Edge };
  /// What lies within reach of the point: nothing but table, nothing but a top, or an edge.
  Around around(double x_mm, double y_mm);

  /// Distance along the ray (direction of unit length, pointing down) to the surface; negative when it goes
  /// up.
  double cast(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) const;
  /// Whether the straight way from a surface point to the eye is free.
  bool sees(const Eigen::Vector3d& point, const Eigen::Vector3d& eye) const;

 private:
  struct Side {
    Vec2 inward = Vec2::Zero();
    double offset = 0;  ///< inward . p - offset = distance inside of the side's line
    bool round = false;
  };
  struct Body {
    Polygon outline;
    Box2 box;
    std::vector<Side> sides;
    double radius_mm = 0;
    bool convex = true;
  };
  /// Height of a body's top over the table at a point inside of its outline.
  double roof(const Body& body, const Vec2& inside) const;
  double height_of(const Body& body, const Vec2& p) const;
  /// Distance along the ray to the body, looked for from `begin` to `end`, which is also the answer for none.
  double first_hit(const Body& body, const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
                   double begin, double end) const;
  Around classify(const Vec2& center) const;

  double table_mm_, height_mm_, reach_mm_;
  std::vector<Body> bodies_;
  Box2 area_;
  std::size_t columns_ = 0, rows_ = 0;
  std::vector<Around> cells_;
};

}  // namespace weldcell::sim
