// What the simulated laser really does: clock, optics, noise; and how the surfaces under it reflect. Each
// effect has a switch of its own.
#pragma once

#include <cstdint>

namespace weldcell::sim {

struct ClockTruth {
  double offset_s = 0;  ///< device clock at host time 0
  double drift_ppm = 0;
};

/// How a surface reflects. Ideal: as much light as the sensor wants, everywhere.
enum class Finish : std::uint8_t { Ideal, MillScale, GroundSteel, Galvanized, Aluminium, Ceramic };

struct LaserTruth {
  ClockTruth clock{12.3, 30};
  double latency_ms = 2.7;  ///< stamp (and arrival) after mid-exposure
  double exposure_ms = 0.2;
  double transport_jitter_ms = 0.3;  ///< exponential, on the wire
  double spot_mm = 1.1;
  double noise_mm = 0.05;    ///< white, 1 sigma, at the light that the sensor wants
  double speckle_mm = 0.05;  ///< bound to the surface, correlated over half a spot
  double outlier_share = 0.002;
  double dropout_share = 0.001;
  double triangulation_rad = 0.3;
  bool shadows = true;
  bool beam_spot = true;  ///< integrate over the spot; false: a needle

  Finish part = Finish::Ideal, table = Finish::Ideal;
  /// The sensor sets its gain by the light of four samples ago, so samples after a jump of contrast are dark
  /// or saturated. False: always the right gain.
  bool exposure_loop = false;
  /// Share of samples on the table close to a member whose light came by way of the member's side: they read
  /// too far.
  double secondary_share = 0;
  double linearity_share = 0;  ///< peak of the characteristic's error over the range, share of the range
  bool tilt_error =
      false;  ///< reads wrong when the beam is not normal to the surface: 0.12 % of range at 5 deg
};

}  // namespace weldcell::sim
