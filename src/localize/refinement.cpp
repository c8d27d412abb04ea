#include "refinement.hpp"

#include <algorithm>
#include <cmath>

#include "freedom.hpp"

namespace weldcell::localize {

namespace {

/// Odds of the wide prior of the latency over the stated one, before the points speak.
constexpr double kWideLatency_nats = 2;

}  // namespace

Refinement::Refinement(const TemplateFields& fields, const std::vector<Crossing>& crossings,
                       const FitState& start, const Priors& priors, Start nearness)
    : fields_(fields),
      crossings_(crossings),
      priors_(priors),
      start_(nearness),
      free_(fields.member_centroids().size(), Freedom::Held),
      rows_(crossings.size()) {
  fit_.state = start;
  fit_.state.members.assign(free_.size(), MemberShift::Zero());
  fit_.matches.resize(crossings.size());
  fit_.residuals.assign(crossings.size(), 0);
  fit_.inlier.assign(crossings.size(), 0);
  // Until a step has succeeded nothing is known.
  fit_.covariance.diagonal().setConstant(1e6);
  fit_.member_covariance.assign(free_.size(), 1e6 * Eigen::Matrix3d::Identity());
  if (!any_speed(crossings)) priors_.latency_ms = 0;
}

void Refinement::adopt(const Refinement& coarse) {
  priors_ = coarse.priors_;
  free_ = coarse.free_;
  fit_.state = coarse.fit_.state;
  fit_.scale = coarse.fit_.scale;
  fit_.iterations = coarse.fit_.iterations;
  fit_.covariance = coarse.fit_.covariance;
  fit_.member_covariance = coarse.fit_.member_covariance;
}

bool Refinement::any_wide() const {
  return !few(free_) && std::count(free_.begin(), free_.end(), Freedom::Wide) > 0;
}

void Refinement::hold_along() {
  for (std::size_t m = 0; m < free_.size(); ++m) {
    if (free_[m] != Freedom::Wide) continue;
    free_[m] = Freedom::Pulled;
    MemberShift& u = fit_.state.members[m];
    const Vec2& d = fields_.member_frames()[m].axis;
    u.head<2>() -= u.head<2>().dot(d) * d;
  }
}

Fit Refinement::run() {
  for (int step = 0; step < kSteps; ++step) iterate(step);
  weigh_other_members();
  finish();
  return std::move(fit_);
}

void Refinement::place() {
  const double c = std::cos(fit_.state.pose.theta_rad), s = std::sin(fit_.state.pose.theta_rad);
  for (std::size_t i = 0; i < crossings_.size(); ++i) {
    fit_.matches[i] = match(fields_, crossings_[i], fit_.state.pose, c, s);
    if (fit_.matches[i].edge < 0) continue;
    rows_[i] = row_of(fields_, crossings_[i], fit_.matches[i], c, s, priors_.inset_everywhere);
    fit_.residuals[i] = net_residual(fields_, rows_[i], fit_.matches[i], fit_.state);
  }
}

void Refinement::weigh_geman_mcclure(NormalEquations& equations, double scale) {
  for (std::size_t i = 0; i < crossings_.size(); ++i) {
    if (fit_.matches[i].edge < 0) continue;
    const double ratio = 1 + squared_miss(fit_.residuals[i], fit_.matches[i]) / (scale * scale);
    // Half a millimetre stands for what the stated sigma does not know at this stage.
    const double variance = 0.25 + crossings_[i].sigma_mm * crossings_[i].sigma_mm;
    equations.add(member_of(i), rows_[i], 1 / (ratio * ratio * variance));
  }
}

void Refinement::weigh_mixture(NormalEquations& equations) {
  for (std::size_t i = 0; i < crossings_.size(); ++i) {
    fit_.inlier[i] = 0;
    if (fit_.matches[i].edge < 0) continue;
    const double sigma = crossings_[i].sigma_mm * fit_.scale;
    const double miss = squared_miss(fit_.residuals[i], fit_.matches[i]) / (sigma * sigma);
    fit_.inlier[i] = 1 / (1 + std::exp(std::min(0.5 * (miss - kInlierGate * kInlierGate), 50.0)));
    if (fit_.inlier[i] > 1e-6) equations.add(member_of(i), rows_[i], fit_.inlier[i] / (sigma * sigma));
  }
}

void Refinement::iterate(int step) {
  place();
  NormalEquations equations(fields_.member_frames(), priors_);
  weigh_mixture(equations);
  if (step == kSteps - 1 && !few(free_)) strained_ = !most_strained(equations, priors_, free_).empty();
  const Detail detail = step + 1 < kSteps ? Detail::Shifts : Detail::All;
  take(mean_of(answers(equations, free_, detail)), detail);
  if (step == 1 || step == 2) rescale();
}

std::vector<double> Refinement::latencies_ms() const {
  if (priors_.latency_ms <= 0) return {0};
  return {priors_.latency_ms, kWideLatency_ms};
}

std::vector<Weighed> Refinement::answers(const NormalEquations& equations, const Freedoms& freedoms,
                                         Detail detail) const {
  const std::vector<double> latencies = latencies_ms();
  std::vector<Weighed> out = equations.over_scales(freedoms, latencies, detail);
  for (std::size_t i = 1; latencies.size() == 2 && i < out.size(); i += 2) {
    out[i].log_weight += kWideLatency_nats;
    out[i].log_bet += kWideLatency_nats;
  }
  return out;
}

Estimate Refinement::after(const Solution& solution, Detail detail) const {
  Estimate out = fit_;
  move(out.state.pose, solution.common);
  out.state.latency_ms = solution.common(3);
  out.state.inset_mm = solution.common(4);
  out.covariance = solution.covariance;
  out.chances = solution.chances;
  for (std::size_t m = 0; m < free_.size(); ++m) {
    out.state.members[m] = solution.members[m].shift;
    if (detail == Detail::All) out.member_covariance[m] = solution.members[m].covariance;
  }
  return out;
}

void Refinement::rescale() {
  place();
  double sum = 20, count = 20;
  for (std::size_t i = 0; i < crossings_.size(); ++i) {
    if (fit_.matches[i].edge < 0) continue;
    const double ratio = fit_.residuals[i] / crossings_[i].sigma_mm;
    sum += fit_.inlier[i] * ratio * ratio;
    count += fit_.inlier[i];
  }
  fit_.scale = std::max(1.0, std::sqrt(sum / std::max(1.0, count - 5)));
}

void Refinement::take(const Solution& solution, Detail detail) {
  if (!solution.common.allFinite()) return;
  static_cast<Estimate&>(fit_) = after(solution, detail);
  ++fit_.iterations;
}

void Refinement::finish() {
  place();
  const double clutter = std::exp(-kInlierGate * kInlierGate / 2);
  fit_.member_points.assign(free_.size(), 0);
  for (std::size_t i = 0; i < crossings_.size(); ++i) {
    double good = 0;
    fit_.inlier[i] = 0;
    if (fit_.matches[i].edge >= 0) {
      const double sigma = crossings_[i].sigma_mm * fit_.scale;
      good = std::exp(-0.5 * squared_miss(fit_.residuals[i], fit_.matches[i]) / (sigma * sigma));
      fit_.inlier[i] = good / (good + clutter);
      if (fit_.inlier[i] > 0.5) ++fit_.member_points[static_cast<std::size_t>(member_of(i))];
      // A wider sigma explains more, and each point less well.
      good /= fit_.scale;
    }
    fit_.log_likelihood += std::log(good + clutter);
  }
  for (const MemberShift& u : fit_.state.members) {
    const double shift = std::max(priors_.member_shift_mm, 0.1),
                 angle = std::max(priors_.member_angle_rad, 0.0005);
    // Twice the tolerance: about what the widest likely scale allows.
    fit_.log_likelihood -=
        0.5 * (u.head<2>().squaredNorm() / (4 * shift * shift) + u.z() * u.z() / (4 * angle * angle));
  }
}

}  // namespace weldcell::localize
