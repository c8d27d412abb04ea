// One crossing of a height step by the beam, and one straight piece of the beam's travel. Frame Base, mm.
// Pure.
#pragma once

namespace weldcell {

struct EdgePoint {
  double x_mm = 0, y_mm = 0;
  double dir_x = 0, dir_y = 0;  ///< unit direction of travel; zero when unknown
  int step = 0;                 ///< +1 the surface rises along the travel, -1 it falls, 0 unknown
  double sigma_mm = 0;          ///< 1 sigma along the travel; 0 = unknown
  double speed_mm_s = 0;        ///< 0 = unknown
  bool shadowed = false;        ///< beside a drop-out: position less certain than a clean step
};

/// A piece of travel with valid readings: an edge that crosses it would have been seen.
struct PathPiece {
  double x0_mm = 0, y0_mm = 0, x1_mm = 0, y1_mm = 0;
};

}  // namespace weldcell
