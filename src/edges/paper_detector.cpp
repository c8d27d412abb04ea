#include <cmath>
#include <vector>

#include "detectors.hpp"

namespace weldcell::edges {
namespace {
constexpr double kWidestSlot = 0.6;  // mm, the paper's figure
}

void detect_by_paper(const Run& run, const EdgeOptions& options, EdgeScan& out) {
  std::vector<std::size_t> valid;
  for (std::size_t i = 0; i < run.points.size(); ++i) {
    if (run.points[i].code == 0) valid.push_back(i);
  }
  const auto z = [&](std::size_t k) { return static_cast<double>(run.points[valid[k]].z_mm); };
  const double threshold = 0.5 * options.height_mm;
  std::size_t k = 0;
  while (k + 1 < valid.size()) {
    // First stage: neighbours; second stage: two apart, for a step that readings fell into, where it is
    // highest.
    std::size_t width = 0;
    const auto over_two = [&](std::size_t i) {
      return i + 2 < valid.size() ? std::abs(z(i + 2) - z(i)) : 0.0;
    };
    if (std::abs(z(k + 1) - z(k)) > threshold) {
      width = 1;
    } else if (over_two(k) > threshold && over_two(k) >= over_two(k + 1)) {
      width = 2;
    }
    if (width == 0) {
      ++k;
      continue;
    }
    ++out.summary.candidates;
    const std::size_t a = valid[k], b = valid[k + width];
    const double slot = run.s_mm[b] - run.s_mm[a], height = z(k + width) - z(k);
    if (slot > kWidestSlot) {
      ++out.summary.paper_slot_too_wide;
    } else {
      const align::SurfacePoint &p = run.points[a], &q = run.points[b];
      EdgePoint edge;
      edge.x_mm = 0.5 * (static_cast<double>(p.x_mm) + static_cast<double>(q.x_mm));
      edge.y_mm = 0.5 * (static_cast<double>(p.y_mm) + static_cast<double>(q.y_mm));
      edge.speed_mm_s = speed_mm_s(p);
      edge.dir_x = static_cast<double>(p.vx_mm_s) / edge.speed_mm_s;
      edge.dir_y = static_cast<double>(p.vy_mm_s) / edge.speed_mm_s;
      edge.step = height > 0 ? 1 : -1;
      edge.sigma_mm = slot / std::sqrt(12.0);
      out.edges.push_back(edge);
      out.top_z_mm.push_back(std::max(z(k), z(k + width)));
      out.table_z_mm.push_back(std::min(z(k), z(k + width)));
      ++out.summary.accepted;
    }
    k += width;
  }
}

}  // namespace weldcell::edges
