#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "fit.hpp"
#include "freedom.hpp"
#include "normal_equations.hpp"
#include "rows.hpp"

namespace weldcell::localize {

namespace {

constexpr double kWideInset_mm = 3;
/// Odds that a stated prior holds, before the points speak.
constexpr double kPriorHolds_nats = 3;
/// Odds of the wide prior of the latency over the stated one, before the points speak.
constexpr double kWideLatency_nats = 2;
/// Odds of about 1000 : 1 tell which of two members is off.
constexpr double kTellsMembers_nats = 7;
/// So many crossings, evenly taken, tell which members are off and how far sigmas can be believed.
constexpr std::size_t kSettlePoints = 600;
constexpr int kSteps = 4;

/// The loop of refine(): matches, weights, sums, solution, over and over.
class Refinement {
 public:
  Refinement(const TemplateFields& fields, const std::vector<Crossing>& crossings, const FitState& start,
             const Priors& priors, Start nearness)
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

  /// Members, tolerances and scale, from a start that is right to some millimetres.
  void settle() {
    find_members();
    choose_inset();
    free_outlying_members();
  }
  /// What another run over fewer crossings has settled.
  void adopt(const Refinement& coarse) {
    priors_ = coarse.priors_;
    free_ = coarse.free_;
    fit_.state = coarse.fit_.state;
    fit_.scale = coarse.fit_.scale;
    fit_.iterations = coarse.fit_.iterations;
    fit_.covariance = coarse.fit_.covariance;
    fit_.member_covariance = coarse.fit_.member_covariance;
  }
  /// Whether a member is free altogether that could be so in one way only.
  bool any_wide() const { return !few(free_) && std::count(free_.begin(), free_.end(), Freedom::Wide) > 0; }
  /// Members free altogether are held along themselves from here on.
  void hold_along() {
    for (std::size_t m = 0; m < free_.size(); ++m) {
      if (free_[m] != Freedom::Wide) continue;
      free_[m] = Freedom::Pulled;
      MemberShift& u = fit_.state.members[m];
      const Vec2& d = fields_.member_frames()[m].axis;
      u.head<2>() -= u.head<2>().dot(d) * d;
    }
  }
  Fit run() {
    for (int step = 0; step < kSteps; ++step) iterate(step);
    weigh_other_members();
    finish();
    return std::move(fit_);
  }

 private:
  void place() {
    const double c = std::cos(fit_.state.pose.theta_rad), s = std::sin(fit_.state.pose.theta_rad);
    for (std::size_t i = 0; i < crossings_.size(); ++i) {
      fit_.matches[i] = match(fields_, crossings_[i], fit_.state.pose, c, s);
      if (fit_.matches[i].edge < 0) continue;
      rows_[i] = row_of(fields_, crossings_[i], fit_.matches[i], c, s, priors_.inset_everywhere);
      fit_.residuals[i] = net_residual(fields_, rows_[i], fit_.matches[i], fit_.state);
    }
  }

  int member_of(std::size_t i) const {
    return fields_.edges()[static_cast<std::size_t>(fit_.matches[i].edge)].member;
  }

  void weigh_geman_mcclure(NormalEquations& equations, double scale) {
    for (std::size_t i = 0; i < crossings_.size(); ++i) {
      if (fit_.matches[i].edge < 0) continue;
      const double ratio = 1 + squared_miss(fit_.residuals[i], fit_.matches[i]) / (scale * scale);
      // Half a millimetre stands for what the stated sigma does not know at this stage.
      const double variance = 0.25 + crossings_[i].sigma_mm * crossings_[i].sigma_mm;
      equations.add(member_of(i), rows_[i], 1 / (ratio * ratio * variance));
    }
  }

  void weigh_mixture(NormalEquations& equations) {
    for (std::size_t i = 0; i < crossings_.size(); ++i) {
      fit_.inlier[i] = 0;
      if (fit_.matches[i].edge < 0) continue;
      const double sigma = crossings_[i].sigma_mm * fit_.scale;
      const double miss = squared_miss(fit_.residuals[i], fit_.matches[i]) / (sigma * sigma);
      fit_.inlier[i] = 1 / (1 + std::exp(std::min(0.5 * (miss - kInlierGate * kInlierGate), 50.0)));
      if (fit_.inlier[i] > 1e-6) equations.add(member_of(i), rows_[i], fit_.inlier[i] / (sigma * sigma));
    }
  }

  /// Pose and members together with wide priors, so that a member some millimetres off keeps its points.
  void find_members() {
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

  /// The median of the residuals says whether the stated sigmas can be believed.
  void measure_scale() {
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

  /// Sharp edges in the drawing: an inset is only believed when the points insist on it. Round ones: its
  /// prior gives way when the points insist.
  void choose_inset() {
    place();
    if (priors_.inset_mm <= 0) return;
    const bool any_round = std::any_of(fields_.edges().begin(), fields_.edges().end(),
                                       [](const FieldEdge& e) { return e.round; });
    Priors without = priors_, wide = priors_;
    wide.inset_mm = kWideInset_mm;
    wide.inset_everywhere = !any_round;
    if (!any_round) without.inset_mm = 0;
    priors_ = evidence_of(wide) > evidence_of(without) + kPriorHolds_nats ? wide : without;
  }

  double evidence_of(const Priors& priors) {
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

  static bool is_free(Freedom f) { return f != Freedom::Held; }

  /// One member far off among members that are as drawn must not widen the tolerance of all: it is set free
  /// when the evidence pays for its freedom.
  void free_outlying_members() {
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

  void iterate(int step) {
    place();
    NormalEquations equations(fields_.member_frames(), priors_);
    weigh_mixture(equations);
    if (step == kSteps - 1 && !few(free_)) strained_ = !most_strained(equations, priors_, free_).empty();
    const Detail detail = step + 1 < kSteps ? Detail::Shifts : Detail::All;
    take(mean_of(answers(equations, free_, detail)), detail);
    if (step == 1 || step == 2) rescale();
  }

  /// A latency outside its prior must not bend the pose: its stated prior and a wide one stand side by side,
  /// and the evidence, which charges the wide one for what it allows, weighs them.
  std::vector<double> latencies_ms() const {
    if (priors_.latency_ms <= 0) return {0};
    return {priors_.latency_ms, kWideLatency_ms};
  }

  /// Over scales and latencies. Where a scan tells a latency from a turn by little the stated prior, which
  /// bends the pose when it is wrong, must be the likelier one by more than the charge alone.
  std::vector<Weighed> answers(const NormalEquations& equations, const Freedoms& freedoms,
                               Detail detail = Detail::All) const {
    const std::vector<double> latencies = latencies_ms();
    std::vector<Weighed> out = equations.over_scales(freedoms, latencies, detail);
    for (std::size_t i = 1; latencies.size() == 2 && i < out.size(); i += 2) {
      out[i].log_weight += kWideLatency_nats;
      out[i].log_bet += kWideLatency_nats;
    }
    return out;
  }

  /// A member may be off in one way or another, or hardly at all; a rail pulled off its rungs, moreover,
  /// looks the same as the rest of the part pulled off that rail. What explains the points about as well
  /// takes part in the covariance.
  void weigh_other_members() {
    const auto freed = std::count_if(free_.begin(), free_.end(), is_free);
    if (freed > 1 || priors_.member_shift_mm <= 0 || (freed == 0 && !strained_)) return;
    place();
    NormalEquations equations(fields_.member_frames(), priors_);
    weigh_mixture(equations);
    const std::vector<std::size_t> members =
        freed == 0 ? most_strained(equations, priors_, free_)
                   : with_the_likeliest_instead(equations, free_, latencies_ms());
    if (members.empty()) return;
    const Freedoms drawn(free_.size(), Freedom::Held);
    const std::vector<Hypothesis> all = hypotheses(equations, drawn, members, latencies_ms());
    const std::vector<double> sums = sum_by_member(all, free_.size());
    const std::size_t first = likeliest(sums);
    const double as_drawn =
        few(free_) ? -1e300 : equations.evidence_with(drawn, {Freed{}}, latencies_ms()).front();
    const double least = std::max(sums[first], as_drawn) - kTellsMembers_nats;
    if (sums[first] < least) return;
    std::vector<Weighed> common;
    if (as_drawn > least) common = answers(equations, drawn);
    const auto reading = [&](std::size_t member) {
      std::vector<Weighed> out = common;
      for (const Hypothesis& h : all) {
        if (h.freed.member != member || h.nats < sums[member] - kTellsMembers_nats) continue;
        Freedoms freedoms = drawn;
        freedoms[member] = h.freed.freedom;
        for (Weighed& w : answers(equations, freedoms)) {
          w.log_weight -= h.odds_nats;
          w.log_bet -= h.odds_nats;
          out.push_back(std::move(w));
        }
      }
      return out;
    };
    const std::vector<Weighed> stated = reading(first);
    Solution estimate = mean_of(stated);
    // The likelier reading instead of the mean, which would be right in neither case; the covariance is the
    // mean square about it over both.
    std::vector<double> others = sums;
    others[first] = -1e300;
    const std::size_t second = likeliest(others);
    if (others[second] < least || as_drawn > sums[first]) {
      take(estimate);
      return;
    }
    std::vector<Weighed> swapped = reading(second), both = stated;
    Either either{{static_cast<int>(first), after(estimate)},
                  {static_cast<int>(second), after(mean_of(swapped))},
                  estimate.members[first].shift.head<2>().norm()};
    swapped.erase(swapped.begin(), swapped.begin() + static_cast<std::ptrdiff_t>(common.size()));
    both.insert(both.end(), std::make_move_iterator(swapped.begin()), std::make_move_iterator(swapped.end()));
    take(about(both, estimate));
    fit_.either = std::move(either);
  }

  /// What a solution leads to from here.
  Estimate after(const Solution& solution, Detail detail = Detail::All) const {
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

  /// Residuals larger than stated widen everything; smaller ones are not believed.
  void rescale() {
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

  void take(const Solution& solution, Detail detail = Detail::All) {
    if (!solution.common.allFinite()) return;
    static_cast<Estimate&>(fit_) = after(solution, detail);
    ++fit_.iterations;
  }

  void finish() {
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

  /// Sigmas of tolerance and measurement together at which a member no longer counts as set up by the
  /// drawing.
  static constexpr double kFarOff = 4.5;

  const TemplateFields& fields_;
  const std::vector<Crossing>& crossings_;
  Priors priors_;
  Start start_;
  Freedoms free_;
  bool strained_ = false;  ///< some member presses against a tight tolerance
  std::vector<Row> rows_;
  Fit fit_;
};

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
