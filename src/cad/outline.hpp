// Segments -> outlines: the outer boundary of an arrangement, chains that close, straightened sides, round
// edges. Pure.
#pragma once

#include <optional>
#include <vector>

#include "weldcell/geometry/plane.hpp"

namespace weldcell::cad {

/// Ends closer than this are one point; solids whose faces fit worse are tried again with a coarser measure.
inline constexpr double kWeldMm = 2e-4;

/// Points merged within kWeldMm; ids in order of first sight.
class PointPool {
 public:
  explicit PointPool(double tolerance_mm = kWeldMm) : tolerance_mm_(tolerance_mm) {}
  int id(const Vec2& p);
  const Vec2& point(int id) const { return points_[static_cast<std::size_t>(id)]; }
  std::size_t size() const { return points_.size(); }

 private:
  double tolerance_mm_;
  std::vector<Vec2> points_;
  std::vector<std::pair<std::pair<long long, long long>, int>> cells_;  ///< sorted by cell
};

/// Outer boundary of the union of what the segments enclose, counter-clockwise; nullopt when they enclose
/// nothing or do not hang together. At most a few thousand segments (quadratic).
std::optional<Polygon> outer_boundary(const std::vector<Segment>& segments, double weld_mm = kWeldMm);

/// Without vertices that lie within tolerance_mm of the line between their neighbours, and without doubled
/// ones.
Polygon straightened(const Polygon& polygon, double tolerance_mm = 0.01);

/// Direction of the longest side.
Vec2 main_axis(const Polygon& polygon);
/// Indices i of the sides i -> i+1 that run along the main axis.
std::vector<std::size_t> long_sides(const Polygon& polygon);
/// The polygon with its long sides moved outward by distance_mm, neighbouring sides prolonged.
Polygon widened(const Polygon& polygon, double distance_mm);
/// Extent across the main axis.
double width_across(const Polygon& polygon);

/// Length over which two outlines touch, their sides at most gap_mm apart.
double contact_length(const Polygon& a, const Polygon& b, double gap_mm);
/// Contact lines as polylines, each at least min_length_mm long.
std::vector<std::vector<Vec2>> contact_lines(const Polygon& a, const Polygon& b, double gap_mm,
                                             double min_length_mm);
/// How deep the outlines overlap: greatest distance of a vertex or side's midpoint of one inside the other,
/// mm.
double overlap_depth(const Polygon& a, const Polygon& b);

}  // namespace weldcell::cad
