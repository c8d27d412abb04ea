// Which members are off, which priors hold and how far sigmas can be believed, before the fit itself.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "freedom.hpp"
#include "refinement.hpp"

namespace weldcell::localize {

namespace {

constexpr double kWideInset_mm = 3;
/// Odds that a stated prior holds, before the points speak.
constexpr double kPriorHolds_nats = 3;
/// Sigmas of tolerance and measurement together at which a member no longer counts as set up by the
/// drawing.
constexpr double kFarOff = 4.5;

}  // namespace

void Refinement::settle() {
  find_members();
  choose_inset();
  free_outlying_members();
}

void Refinement::find_members() {
  Priors wide = priors_;
  wide.latency_ms = priors_.latency_ms > 0 ? kWideLatency_ms : 0;
  if (start_ == Start::Rough) {
    wide.member_shift_mm = 2;
    wide.member_angle_rad = 0.01;
  }
  NormalEquations equations(fields_.member_frames(), wide);
  for (const double scale : {5.0, 3.0, 2.0}) {
    if (start_ == Start::Close && scale > 2) continue;
    place();
    equations.clear();
    weigh_geman_mcclure(equations, scale);
    const Detail detail = scale > 2 ? Detail::Shifts : Detail::All;
    take(equations.solve(1, free_, detail), detail);
  }
  const double shift = std::max(priors_.member_shift_mm, 0.2),
               angle = std::max(priors_.member_angle_rad, 0.001);
  const Eigen::Vector3d tolerance(shift * shift, shift * shift, angle * angle);
  for (std::size_t m = 0; m < free_.size(); ++m) {
    const MemberShift& u = fit_.state.members[m];
    Eigen::Matrix3d spread = fit_.member_covariance[m];
    spread.diagonal() += tolerance;
    free_[m] = u.dot(spread.ldlt().solve(u)) > kFarOff * kFarOff ? Freedom::Wide : Freedom::Held;
  }
  measure_scale();
}

void Refinement::measure_scale() {
  place();
  std::vector<double> ratios;
  for (std::size_t i = 0; i < crossings_.size(); ++i) {
    if (fit_.matches[i].edge < 0) continue;
    const double miss = std::sqrt(squared_miss(fit_.residuals[i], fit_.matches[i]));
    if (miss < 6) ratios.push_back(miss / crossings_[i].sigma_mm);
  }
  if (ratios.size() < 4) return;
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  fit_.scale = std::clamp(*middle / 0.6745, 1.0, 1e3);
}

void Refinement::choose_inset() {
  place();
  if (priors_.inset_mm <= 0) return;
  const bool any_round =
      std::any_of(fields_.edges().begin(), fields_.edges().end(), [](const FieldEdge& e) { return e.round; });
  Priors without = priors_, wide = priors_;
  wide.inset_mm = kWideInset_mm;
  wide.inset_everywhere = !any_round;
  if (!any_round) without.inset_mm = 0;
  priors_ = evidence_of(wide) > evidence_of(without) + kPriorHolds_nats ? wide : without;
}

double Refinement::evidence_of(const Priors& priors) {
  NormalEquations equations(fields_.member_frames(), priors);
  const double c = std::cos(fit_.state.pose.theta_rad), s = std::sin(fit_.state.pose.theta_rad);
  for (std::size_t i = 0; i < crossings_.size(); ++i) {
    if (fit_.matches[i].edge < 0) continue;
    const double sigma = crossings_[i].sigma_mm * fit_.scale;
    const double miss = squared_miss(fit_.residuals[i], fit_.matches[i]) / (sigma * sigma);
    const double inlier = 1 / (1 + std::exp(std::min(0.5 * (miss - kInlierGate * kInlierGate), 50.0)));
    if (inlier < 1e-6) continue;
    const Row row = row_of(fields_, crossings_[i], fit_.matches[i], c, s, priors.inset_everywhere);
    equations.add(member_of(i), row, inlier / (sigma * sigma));
  }
  return equations.evidence(free_);
}

void Refinement::free_outlying_members() {
  NormalEquations equations(fields_.member_frames(), priors_);
  if (priors_.member_shift_mm <= 0) return;
  place();
  weigh_mixture(equations);
  double held = equations.evidence(free_);
  for (std::size_t freed = 0; freed < std::max<std::size_t>(1, free_.size() / 4); ++freed) {
    const std::vector<std::size_t> tried = most_strained(equations, priors_, free_);
    if (tried.empty()) return;
    const std::vector<Hypothesis> all = hypotheses(equations, free_, tried, {priors_.latency_ms});
    const std::vector<double> sums = sum_by_member(all, free_.size());
    const std::size_t member = likeliest(sums);
    if (sums[member] <= held) return;
    held = -1e300;
    for (const Hypothesis& h : all) {
      if (h.freed.member != member || h.nats <= held) continue;
      free_[member] = h.freed.freedom;
      held = h.nats;
    }
  }
}

}  // namespace weldcell::localize
