// Surface points -> edge points: height steps of a scan, localized below the sample distance. Pure.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "weldcell/align/aligner.hpp"
#include "weldcell/geometry/edge_point.hpp"

namespace weldcell::edges {

enum class Method : std::uint8_t { Model, Paper };

struct EdgeOptions {
  Method method = Method::Model;
  double height_mm = 0;            ///< step expected from the drawing; must be > 0
  double height_tolerance = 0.35;  ///< accepted deviation as a share of height_mm
  double spot_mm = 1.1;            ///< beam diameter
  double noise_mm = 0.1;           ///< 1 sigma of one reading
  double triangulation_rad = 0.3;
  double min_speed_mm_s = 20;      ///< slower stretches are not searched
  double time_sigma_s = 20e-6;     ///< alignment noise, added to each edge's sigma as speed * time_sigma_s
};

struct EdgeSummary {
  std::uint64_t candidates = 0, accepted = 0, shadowed = 0, bad_height = 0, bad_fit = 0, paper_slot_too_wide = 0;
};

struct EdgeScan {
  std::vector<EdgePoint> edges;
  std::vector<PathPiece> path;     ///< where the beam travelled with valid readings: an unseen edge counts there
  std::vector<double> top_z_mm;    ///< plateau height above each edge (same index as edges), Base
  std::vector<double> table_z_mm;  ///< plateau height below each edge, Base
  EdgeSummary summary;
};

/// Points must be in order of time. Pauses, reversals and gaps split the scan by themselves.
EdgeScan detect(std::span<const align::SurfacePoint> points, const EdgeOptions& options);

}  // namespace weldcell::edges
