// Simulated edge sets with known truth: raster and spiral scans, noise, clutter, drop-outs, members off,
// round edges, latency; and the lowest covariance that any estimate from them can have. Pure.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "weldcell/geometry/edge_point.hpp"
#include "weldcell/workpiece/outline_template.hpp"

namespace weldcell::bench {

inline constexpr double kGrazing = 0.1;  ///< |travel . normal| below which no step is seen

/// How a part lies and is scanned. The part lies within shift_mm (each axis) and turn_deg of planned, members
/// within member_mm (each axis) and member_deg of the drawing; all uniform.
struct Setting {
  double sigma_mm = 0.3, outliers = 0.05, latency_s = 0, pitch_mm = 40, speed_mm_s = 200;
  double drop_out = 0;
  int members_missing = 0;
  double member_mm = 0, member_deg = 0;
  double shift_mm = 15, turn_deg = 20;
  /// Stray steps lie where the beam passed, as a real scan's do; else anywhere on the table, as the
  /// development sets' do.
  bool strays_on_path = false;
  double inset_mm = 0;  ///< round edges are seen this far inside the outline
  bool spiral = false;
};

struct EdgeSet {
  std::vector<EdgePoint> edges;
  std::vector<PathPiece> path;
  Pose2 truth;
  std::vector<Pose2> member_moves;  ///< each member's own, frame Part
  std::vector<int> edge_of_point;   ///< index into the template's edges, -1 = clutter
};

/// What the scan of `part` sees; `part` is what lies there, not the drawing. The path is the given one
/// (frame Base), or else a raster or spiral over the planned place.
EdgeSet make_set(const workpiece::OutlineTemplate& part, const Setting& setting, std::uint64_t seed,
                 std::span<const PathPiece> path = {});

/// To and fro over a disc about the origin, in lines along x and then along y.
std::vector<PathPiece> raster(double radius_mm, double pitch_mm, double phase);
/// One way over that disc, from the middle outwards, turns pitch_mm apart.
std::vector<PathPiece> spiral(double radius_mm, double pitch_mm);

/// Covariance of (x, y, theta, latency) about the centroid, mm, rad and ms, of generalized least squares over
/// the true correspondences with the members' true variances (the Cramer-Rao bound when no member is off).
/// Latency counts as unknown when it is not zero, the inset of round edges as known to 0.5 mm.
Eigen::Matrix4d bound(const workpiece::OutlineTemplate& part, const Setting& setting, const EdgeSet& set);

}  // namespace weldcell::bench
