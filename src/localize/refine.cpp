#include <cmath>

#include "fit.hpp"
#include "refinement.hpp"

namespace weldcell::localize {

namespace {

/// So many crossings, evenly taken, tell which members are off and how far sigmas can be believed.
constexpr std::size_t kSettlePoints = 600;

}  // namespace

Fit refine(const TemplateFields& fields, const std::vector<Crossing>& crossings, const FitState& start,
           const Priors& priors, Start nearness) {
  Refinement all(fields, crossings, start, priors, nearness);
  if (crossings.size() <= kSettlePoints) {
    all.settle();
  } else {
    const std::vector<Crossing> even = sampled(crossings, kSettlePoints);
    Refinement coarse(fields, even, start, priors, nearness);
    coarse.settle();
    all.adopt(coarse);
  }
  if (!all.any_wide()) return all.run();
  // One or two points on its ends, or a stray one in place of them, must not carry a free member along
  // itself.
  Refinement held = all;
  held.hold_along();
  Fit free = all.run(), other = held.run();
  return other.log_likelihood > free.log_likelihood ? other : free;
}

void settle_on(const TemplateFields& fields, const std::vector<Crossing>& crossings, const Estimate& estimate,
               Fit& fit) {
  static_cast<Estimate&>(fit) = estimate;
  const CentredPose& pose = fit.state.pose;
  const double c = std::cos(pose.theta_rad), s = std::sin(pose.theta_rad);
  for (std::size_t i = 0; i < crossings.size(); ++i) fit.matches[i] = match(fields, crossings[i], pose, c, s);
}

}  // namespace weldcell::localize
