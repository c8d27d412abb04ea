// How much light comes back and what its amount does to a reading. Pure. Sources: triangulation sensors' data
// sheets for tilt (0.12, 0.2, 0.5 % of range at 5, 15, 30 deg) and for the four-stage pipeline; the
// reflectances are plausible starting values, not measured ones.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

#include "weldcell/sim/laser_truth.hpp"

namespace weldcell::sim {

/// Light towards the receiver, 1 = a white ceramic plate seen straight on. `beam` and `to_receiver` are unit
/// vectors, the surface is level. Galvanized steel is patchy: `seed` and the place say how.
double brightness(Finish finish, const Eigen::Vector3d& beam, const Eigen::Vector3d& to_receiver,
                  const Eigen::Vector3d& place_mm, std::uint64_t seed);

/// The sensor's gain and what it makes of the light.
class ExposureLoop {
 public:
  struct Level {
    double noise_factor = 1;  ///< on the white noise
    bool lost = false;        ///< too dark for a peak, or burnt out
  };
  /// `light` is what the next sample catches in its peak (brightness times visible share; 0: nothing); the
  /// gain follows from the light four samples before.
  Level next(double light);

  static constexpr std::size_t kPipeline = 4;
  /// Against the light that the gain was set for.
  static constexpr double kDark = 0.08, kSaturated = 4, kBurnt = 16;

 private:
  std::array<double, kPipeline> before_{};
  std::size_t at_ = 0;
  double gain_ = 1;
};

/// Error of the characteristic at a reading (mm from start of range), peak `share` of the range; two sine
/// terms.
double linearity_error_mm(double reading_mm, double range_mm, double share);

/// Error of a beam that meets a level surface at an angle, mm; positive (too far) when it leans towards the
/// receiver.
double tilt_error_mm(const Eigen::Vector3d& beam, const Eigen::Vector3d& towards_receiver, double range_mm);

}  // namespace weldcell::sim
