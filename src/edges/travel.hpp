// The scan as runs of steady travel, each point with its place along the travel in millimetres. Pure.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "weldcell/align/aligner.hpp"
#include "weldcell/edges/edges.hpp"

namespace weldcell::edges {

/// A stretch without pause, reversal or hole. Index 0 is the run's first point.
struct Run {
  std::span<const align::SurfacePoint> points;
  std::span<const double> s_mm;  ///< travelled since the scan's first point, never falling
};

/// Owns the travelled lengths that its runs point into.
class Travel {
 public:
  Travel(std::span<const align::SurfacePoint> points, double min_speed_mm_s);
  const std::vector<Run>& runs() const { return runs_; }

 private:
  std::vector<double> s_mm_;
  std::vector<Run> runs_;
};

double speed_mm_s(const align::SurfacePoint& point);

/// First point of the run at or beyond s; the run's size when there is none.
std::size_t index_at(const Run& run, double s_mm);

/// Where the beam's foot was on the plane of `side` when it had travelled s: read from the nearest valid
/// points on that side (+1 beyond s, -1 before it), so that a tilted beam's sideways jump at the step does
/// not enter.
struct Place {
  double x_mm = 0, y_mm = 0, dir_x = 0, dir_y = 0, speed_mm_s = 0;
};
Place place_at(const Run& run, double s_mm, int side, double clearance_mm);

/// Pieces of valid travel without the stretches in `hidden` (pairs of s, sorted), ends drawn in by margin_mm,
/// straight to 0.2 mm.
struct Stretch {
  double from_mm = 0, to_mm = 0;
};
void append_path(const Run& run, std::span<const Stretch> hidden, double margin_mm,
                 std::vector<PathPiece>& out);

}  // namespace weldcell::edges
