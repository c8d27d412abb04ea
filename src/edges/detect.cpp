#include <algorithm>

#include "detectors.hpp"
#include "weldcell/base/assert.hpp"

namespace weldcell::edges {
namespace {

constexpr double kNeighbour = 1.2;      // mm kept away from the next step's crossing
constexpr double kBesideDropout = 0.5;  // mm beside a drop-out that the sensor distorts
constexpr double kUnsearched =
    2.5;  // mm at a run's ends where the windows do not fit: no edge can be missed there
constexpr double kRefused = 3.0;  // mm around a refused step: something is there, so nothing was missed

/// How far the readings around candidate k are its own.
Stretch own_part(const Run& run, const Candidates& found, std::size_t k) {
  const Candidate& c = found.steps[k];
  Stretch own{run.s_mm.front(), run.s_mm.back()};
  if (k > 0) own.from_mm = std::max(own.from_mm, found.steps[k - 1].s_mm + kNeighbour);
  if (k + 1 < found.steps.size()) own.to_mm = std::min(own.to_mm, found.steps[k + 1].s_mm - kNeighbour);
  for (const Stretch& hidden : found.dropouts) {
    if (c.beside_dropout && hidden.from_mm == c.hidden.from_mm) continue;
    if (hidden.to_mm <= c.s_mm) own.from_mm = std::max(own.from_mm, hidden.to_mm + kBesideDropout);
    if (hidden.from_mm >= c.s_mm) own.to_mm = std::min(own.to_mm, hidden.from_mm - kBesideDropout);
  }
  return own;
}

Located locate(const Run& run, const Candidate& c, const Stretch& own, const EdgeOptions& options,
               EdgeSummary& summary) {
  if (crossing_of(run, c, options).square < kGlancing) {
    ++summary.bad_fit;
    return {};
  }
  if (c.beside_dropout && is_shadow(run, c, options)) return locate_by_shadow(run, c, options, summary);
  return locate_by_model(run, c, own.from_mm, own.to_mm, options, summary);
}

void detect_by_model(const Run& run, const EdgeOptions& options, EdgeScan& out) {
  const Candidates found = find_candidates(run, options.height_mm, options.spot_mm);
  std::vector<Stretch> refused;
  for (std::size_t k = 0; k < found.steps.size(); ++k) {
    const Candidate& c = found.steps[k];
    ++out.summary.candidates;
    const Located located = locate(run, c, own_part(run, found, k), options, out.summary);
    if (located.accepted) {
      add_edge(run, located, c.step, options, out);
    } else {
      refused.push_back({c.s_mm - kRefused, c.s_mm + kRefused});
    }
  }
  append_path(run, refused, kUnsearched, out.path);
}

}  // namespace

EdgeScan detect(std::span<const align::SurfacePoint> points, const EdgeOptions& options) {
  WELDCELL_ASSERT(options.height_mm > 0);
  EdgeScan out;
  const Travel travel(points, options.min_speed_mm_s);
  for (const Run& run : travel.runs()) {
    if (options.method == Method::Model) {
      detect_by_model(run, options, out);
    } else {
      detect_by_paper(run, options, out);
      append_path(run, {}, kUnsearched, out.path);
    }
  }
  return out;
}

}  // namespace weldcell::edges
