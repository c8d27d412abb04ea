// Surface points -> edge points: height steps of a scan, localized below the sample distance. Pure.
//
// The point reported is where the outline crosses the beam's travel: the silhouette seen along the beam. At a
// sharp corner (r = 0) that is the half-height crossing of the blurred step, unbiased. At a rounded corner
// the step seen falls from height - r at the silhouette to the table, with a quarter circle above; the corner
// is fitted as well (depth and length of the rounding), so that the point stays on the silhouette: |bias| <=
// 0.05 mm for r = 0 and r = 4 at a height of 40 mm (tests/unit/edges/bias_test.cpp). Beside a drop-out of the
// height's shadow the point comes from the last valid reading of the upper side, less the overhang at which
// the sensor still sees light_threshold of the spot.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "weldcell/align/aligner.hpp"
#include "weldcell/geometry/edge_point.hpp"
#include "weldcell/geometry/plane.hpp"

namespace weldcell::edges {

enum class Method : std::uint8_t { Model, Paper };

struct EdgeOptions {
  Method method = Method::Model;
  double height_mm = 0;            ///< step expected from the drawing; must be > 0
  double height_tolerance = 0.35;  ///< accepted deviation as a share of height_mm
  double spot_mm = 1.1;            ///< beam diameter
  double noise_mm = 0.1;           ///< 1 sigma of one reading
  double triangulation_rad = 0.3;
  double min_speed_mm_s = 20;    ///< slower stretches are not searched
  double time_sigma_s = 20e-6;   ///< alignment noise, added to each edge's sigma as speed * time_sigma_s
  double model_sigma_mm = 0.02;  ///< what the edge model itself may be wrong by, added to each edge's sigma
  /// The outline's visible edges in Base (material to the left of a -> b) where they are known to a few
  /// millimetres, e.g. from a first localization; may be empty. Whether the receiver sees a step's foot
  /// depends on the angle between it and the edge's normal: with the outline a shadow too short to darken a
  /// reading is corrected, an oblique one measured along the normal and a glancing crossing refused; without
  /// it each edge's sigma allows for a short shadow.
  std::vector<Segment> outline;
  double light_threshold = 0.06;  ///< share of the spot's light below which the sensor reports an error code
};

struct EdgeSummary {
  std::uint64_t candidates = 0, accepted = 0, shadowed = 0, bad_height = 0, bad_fit = 0,
                paper_slot_too_wide = 0;
};

struct EdgeScan {
  std::vector<EdgePoint> edges;
  std::vector<PathPiece> path;  ///< where the beam travelled with valid readings: an unseen edge counts there
  std::vector<double> top_z_mm;    ///< plateau height above each edge (same index as edges), Base
  std::vector<double> table_z_mm;  ///< plateau height below each edge, Base
  EdgeSummary summary;
};

/// Points must be in order of time. Pauses, reversals and gaps split the scan by themselves.
EdgeScan detect(std::span<const align::SurfacePoint> points, const EdgeOptions& options);

}  // namespace weldcell::edges
