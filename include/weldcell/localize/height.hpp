// Plateau heights beside each edge -> how high the part's top lies and how table and part are tilted. Pure.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "weldcell/geometry/edge_point.hpp"
#include "weldcell/geometry/plane.hpp"

namespace weldcell::localize {

/// z = z_mm + slope_x * (x - x_ref) + slope_y * (y - y_ref), frame Base; slopes in rad (small angles).
struct TiltedPlane {
  double z_mm = 0;     ///< at the reference point
  double slope_x = 0;  ///< rise along Base x: minus the turn about y (pitch)
  double slope_y = 0;  ///< rise along Base y: the turn about x (roll)
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of (z, slope_x, slope_y)
  int points = 0;                                        ///< heights that the fit kept
  double rms_mm = 0;                                     ///< of those about the plane
  double at(const Vec2& p, const Vec2& reference) const {
    return z_mm + slope_x * (p.x() - reference.x()) + slope_y * (p.y() - reference.y());
  }
};

struct HeightFit {
  Vec2 reference = Vec2::Zero();   ///< Base, mm
  std::optional<TiltedPlane> top;  ///< the part's upper surface; absent with fewer than 6 usable heights
  std::optional<TiltedPlane> table;
};

/// Robust planes through the heights above and below each edge (same index as edges; NaN = unknown, left
/// out). Geman-McClure weights from 5 mm down to max(3 sigma, 0.3 mm), so up to a third of the heights may be
/// wrong.
HeightFit fit_heights(std::span<const EdgePoint> edges, std::span<const double> top_z_mm,
                      std::span<const double> table_z_mm, const Vec2& reference, double sigma_mm = 0.1);

}  // namespace weldcell::localize
