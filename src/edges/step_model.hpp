// The height profile of one step seen through a Gaussian spot, with a round upper corner, and its
// derivatives. Pure.
#pragma once

#include <Eigen/Core>

namespace weldcell::edges {

/// Coordinate u runs along the travel, towards the upper side; mm. Lower plateau, jump at the silhouette of
/// high - rounding_depth - low, then a quarter ellipse up to the upper plateau; all of it convolved with the
/// spot.
struct StepModel {
  enum Parameter { Position, Low, High, Slope, LogBlur, Depth, LogLength, kParameters };
  using Vector = Eigen::Matrix<double, kParameters, 1>;

  double position_mm = 0;
  double low_mm = 0, high_mm = 0;  ///< plateaus at u = 0
  double slope = 0;                ///< common to both plateaus
  double blur_mm = 0.275;          ///< standard deviation of the spot's light along the travel
  double depth_mm = 0;             ///< rounding: how deep
  double length_mm = 1;            ///< rounding: how far inside the silhouette

  double height_mm() const { return high_mm - low_mm; }
  /// Height at u; `gradient` with respect to the parameters when not null.
  double value(double u_mm, Vector* gradient) const;
};

}  // namespace weldcell::edges
