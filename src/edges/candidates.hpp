// Where a run may hold a step of the expected height: a score over two one-sided median windows, and
// drop-outs whose two sides differ. Everything in millimetres of travel, whatever the rate and speed. Pure.
#pragma once

#include <vector>

#include "travel.hpp"

namespace weldcell::edges {

struct Candidate {
  double s_mm = 0;                     ///< where the readings cross half-way
  int step = 0;                        ///< +1 rises along the travel
  double before_mm = 0, after_mm = 0;  ///< heights of the two sides
  bool beside_dropout = false;         ///< the two sides are those of the drop-out `hidden`
  Stretch hidden;
};

struct Candidates {
  std::vector<Candidate> steps;   ///< sorted by place
  std::vector<Stretch> dropouts;  ///< stretches of about half a millimetre and more without readings
};

/// Linear in the number of points.
Candidates find_candidates(const Run& run, double height_mm, double spot_mm);

}  // namespace weldcell::edges
