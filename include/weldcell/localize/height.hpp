// Plateau heights beside each edge -> how high the part's top lies and how table and part are tilted. Pure.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "weldcell/geometry/edge_point.hpp"
#include "weldcell/geometry/plane.hpp"
#include "weldcell/localize/localizer.hpp"

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

/// Where steps of a part that stands square to its tilted top would be seen if it stood upright, its top
/// staying where it is; frame Base. The beam falls along Base z. With outward normal n of the edge, slope g
/// of the top, height h and edge radius r, the foot stands out from the upper outline by h n.g, the end of
/// the round edge by r n.g. Where n.g < 0 the top overhangs and the step is at the end of its round edge;
/// where n.g > 0 the wall shows beside the top, grazed and dark, and the step is seen half-way along it.
/// Steps that the receiver sees beside a shadow end with the top and stay, as do those that belong to no edge
/// of the found pose. `found` is of the same edges, in the same order.
std::vector<EdgePoint> upright(std::span<const EdgePoint> edges, const Localization& found,
                               const workpiece::OutlineTemplate& outline, const TiltedPlane& top);

/// A part found twice: as it is seen, and with its lean taken out where that matters.
struct LeaningFit {
  Localization found;
  HeightFit heights;
};

/// The localization, and again of upright() edges where the walls lean by more than 0.01 mm. The covariance
/// then holds what is not known of the lean: a quarter of the shift that was taken out, since a round edge
/// shows less of its wall and a bright wall more.
LeaningFit localize_leaning(const Localizer& localizer, std::span<const EdgePoint> edges,
                            std::span<const double> top_z_mm, std::span<const double> table_z_mm,
                            std::span<const PathPiece> path, const LocalizeOptions& options,
                            double sigma_mm = 0.1);

}  // namespace weldcell::localize
