#include <algorithm>
#include <cmath>

#include "fit.hpp"
#include "rows.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::localize {

namespace {

/// A crossing along the edge itself says nothing about it; the slack covers a pose that is still turned a
/// little wrong.
constexpr double kAlongEdge = -0.03;

}  // namespace

Match match(const TemplateFields& fields, const Crossing& crossing, const CentredPose& pose, double c,
            double s) {
  const Vec2 d = crossing.point - pose.centre;
  Match out;
  out.place = {c * d.x() + s * d.y(), -s * d.x() + c * d.y()};
  const int bin = crossing.signed_step ? bin_of(crossing.inward_rad - pose.theta_rad) : kAnyBin;
  const Vec2 inward(c * crossing.inward.x() + s * crossing.inward.y(),
                    -s * crossing.inward.x() + c * crossing.inward.y());
  double best = 1e300;
  for (const std::uint16_t index : fields.near(bin, out.place)) {
    const FieldEdge& edge = fields.edges()[index];
    if (crossing.signed_step && -edge.outward.dot(inward) < kAlongEdge) continue;
    const Vec2 from = out.place - edge.a;
    const double along = from.dot(edge.direction), across = from.dot(edge.outward);
    const double beyond = std::max({0.0, -along, along - edge.length_mm});
    const double squared = across * across + beyond * beyond;
    if (squared < best) {
      best = squared;
      out.edge = index;
      out.residual_mm = across;
      out.beyond_mm = beyond;
    }
  }
  out.distance_mm = std::sqrt(best);
  return out;
}

FitState polish(const TemplateFields& fields, const std::vector<Crossing>& crossings,
                const CentredPose& start, double first_scale_mm, int* iterations) {
  Priors priors;
  priors.latency_ms = any_speed(crossings) ? kWideLatency_ms : 0;
  priors.inset_mm = 0;
  FitState state;
  state.pose = start;
  NormalEquations equations({MemberFrame{}}, priors);  // members rigid: the part is one
  double scale = first_scale_mm;
  for (int step = 0; step < 12; ++step) {
    const double c = std::cos(state.pose.theta_rad), s = std::sin(state.pose.theta_rad);
    equations.clear();
    for (const Crossing& crossing : crossings) {
      const Match m = match(fields, crossing, state.pose, c, s);
      if (m.edge < 0) continue;
      const Row row = row_of(fields, crossing, m, c, s, false);
      const double miss = squared_miss(net_residual(fields, row, m, state), m);
      const double ratio = 1 + miss / (scale * scale);
      equations.add(0, row, 1 / (ratio * ratio));
    }
    const Common step_found = equations.solve_rigid();
    if (!step_found.allFinite()) break;
    move(state.pose, step_found);
    state.latency_ms = step_found(3);
    if (iterations != nullptr) ++*iterations;
    const double moved = step_found.head<2>().norm() + std::abs(step_found(2)) * fields.radius_mm();
    if (scale <= 3 && moved < 0.05) break;
    scale = std::max(3.0, scale * 0.7);
  }
  return state;
}

double rough_log_likelihood(const TemplateFields& fields, const std::vector<Crossing>& crossings,
                            const FitState& state) {
  const double c = std::cos(state.pose.theta_rad), s = std::sin(state.pose.theta_rad);
  const double clutter = std::exp(-kInlierGate * kInlierGate / 2);
  double sum = 0;
  for (const Crossing& crossing : crossings) {
    const Match m = match(fields, crossing, state.pose, c, s);
    double good = 0;
    if (m.edge >= 0) {
      const Row row = row_of(fields, crossing, m, c, s, false);
      const double variance = 1 + crossing.sigma_mm * crossing.sigma_mm;
      good = std::exp(-squared_miss(net_residual(fields, row, m, state), m) / (2 * variance));
    }
    sum += std::log(good + clutter);
  }
  return sum;
}

}  // namespace weldcell::localize
