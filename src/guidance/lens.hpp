// From points of the table to pixels of the projector: pinhole with radial distortion, clipped to the
// picture. Pure.
#pragma once

#include <optional>
#include <vector>

#include "weldcell/cell/cell_setup.hpp"

namespace weldcell::guidance {

/// The projector as a camera backwards; distances in mm, pixels with the origin at the upper left corner.
class Lens {
 public:
  Lens(const cell::ProjectorSetup& setup, const Transform<Base, Projector>& T_base_projector)
      : setup_(setup), T_projector_base_(T_base_projector.inverse()) {}

  /// Pixel of a point; none behind the projector or so far aside that the lens model does not hold.
  std::optional<Vec2> pixel(const Eigen::Vector3d& base_mm) const;

  /// The polyline over the table at height z, cut to the picture: the pieces that show, in order.
  std::vector<std::vector<Vec2>> visible(const std::vector<Vec2>& line_mm, double z_mm) const;

  double width_px() const { return setup_.width_px; }
  double height_px() const { return setup_.height_px; }

 private:
  cell::ProjectorSetup setup_;
  Transform<Projector, Base> T_projector_base_;
};

/// Cuts the stretch a -> b to the rectangle [0, width] x [0, height] (Liang-Barsky); false when nothing is
/// left.
bool clip(Vec2& a, Vec2& b, double width, double height);

}  // namespace weldcell::guidance
