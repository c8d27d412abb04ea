// The ways to turn candidates of one run into edge points: model fit, shadow rule, and the paper's step
// kernel. Pure.
#pragma once

#include "candidates.hpp"
#include "weldcell/edges/edges.hpp"

namespace weldcell::edges {

/// A located step before it becomes an EdgePoint.
struct Located {
  bool accepted = false;
  double s_mm = 0;
  double sigma_mm = 0;
  double top_mm = 0, table_mm = 0;
  bool shadowed = false;
};

/// Fits the step model, or takes the jump of a sensor that switches between two images, between `from` and
/// `to` (limits of the run's part that belongs to this step).
Located locate_by_model(const Run& run, const Candidate& candidate, double from_mm, double to_mm,
                        const EdgeOptions& options, EdgeSummary& summary);

/// Cosine between travel and normal below which a crossing is glancing: its place along the travel says
/// little.
inline constexpr double kGlancing = 0.3;

/// How the beam crosses the edge, as far as it is known.
struct Crossing {
  bool normal_known = false;
  double square = 1;   ///< |cosine| between travel and the edge's normal; 1 when unknown
  double towards = 0;  ///< cosine between the receiver and the normal that points to the upper side
  double hidden_mm =
      0;  ///< length of the height's shadow along the travel; 0 when the receiver sees the foot
};
Crossing crossing_of(const Run& run, const Candidate& candidate, const EdgeOptions& options);

/// Whether the candidate's drop-out has the direction and about the length of the height's shadow.
bool is_shadow(const Run& run, const Candidate& candidate, const EdgeOptions& options);

/// The drop-out beside the candidate is the height's shadow: places the edge from the upper side's last
/// reading.
Located locate_by_shadow(const Run& run, const Candidate& candidate, const EdgeOptions& options,
                         EdgeSummary& summary);

/// Both plateaus differ by the expected height within the tolerance.
bool height_fits(double height_mm, const EdgeOptions& options);

void add_edge(const Run& run, const Located& located, int step, const EdgeOptions& options, EdgeScan& out);

/// The paper's rule on one run: a step over one or two samples of more than half the height, top and bottom
/// averaged to a slot, slots wider than 0.6 mm dropped.
void detect_by_paper(const Run& run, const EdgeOptions& options, EdgeScan& out);

}  // namespace weldcell::edges
