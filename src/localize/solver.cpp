#include "solver.hpp"

#include <algorithm>
#include <cmath>

#include "alternatives.hpp"
#include "candidates.hpp"
#include "decide.hpp"
#include "describe.hpp"
#include "evidence.hpp"
#include "fit.hpp"
#include "search.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::localize {

namespace {

/// Members within their tolerances lead a fit less far from where it started.
constexpr double kLeft_mm = 3;
/// A millisecond that looks like so much turn at the farthest point is told apart from it by little.
constexpr double kCoupled_mm_per_ms = 0.05;
constexpr double kSameLatency_ms = 1;
/// At least two points, so that no stray one alone tells which of two members is off.
constexpr double kTellsMembers_nats = 12;

/// One run of the robust method over ready crossings.
class Solver {
 public:
  Solver(const workpiece::OutlineTemplate& outline, const TemplateFields& fields, const Crossings& crossings,
         std::span<const PathPiece> path, const LocalizeOptions& options, const StageDone& done)
      : outline_(outline),
        fields_(fields),
        crossings_(crossings.list),
        stray_(crossings.stray),
        path_(path),
        options_(options),
        done_(done) {
    box_ = {centred_pose(outline, options.planned), options.range_mm, std::min(options.range_rad, kPi),
            Vec2(-outline.centroid)};
    priors_.latency_ms = 1e3 * options.latency_sigma_s;
    priors_.inset_mm = options.inset_sigma_mm;
    priors_.member_shift_mm = options.member_shift_sigma_mm;
    priors_.member_angle_rad = options.member_angle_sigma_rad;
  }

  /// False when no pose of the range brings a single point near an edge.
  bool run(std::span<const EdgePoint> edges, Localization& result) {
    medium_ = sampled(crossings_, 400);
    candidates_ = collect_candidates(
        outline_, fields_, box_, medium_, [&] { end(Stage::Search); }, iterations_);
    end(Stage::Polish);
    if (candidates_.empty()) return false;
    fit_ = refined(candidates_.front().state.pose);
    try_other_latencies();
    end(Stage::Refine);
    evidence_ = gather_evidence(fields_, path_, fit_);
    weigh_rivals();
    end(Stage::Rivals);
    tell_member_off();
    const Situation found{outline_, fields_, options_, crossings_, path_, fit_, evidence_, rivals_};
    describe(found, edges, stray_, result);
    result.iterations = iterations_ + fit_.iterations;
    decide(found, result);
    end(Stage::Verdict);
    return true;
  }

 private:
  void end(Stage stage) const {
    if (done_) done_(stage);
  }

  bool image_of_found(const CentredPose& pose) const {
    if (same_place(fields_, pose, fit_.state.pose)) return true;
    const Pose2 found = part_pose(outline_, fit_.state.pose);
    return std::any_of(
        outline_.symmetries.begin(), outline_.symmetries.end(), [&](const workpiece::Symmetry& s) {
          return s.gap_mm == 0 && same_place(fields_, pose, centred_pose(outline_, found * s.map));
        });
  }

  /// Polished and refined. A fit that has left the polished pose has followed a member, or clutter in place
  /// of one; it stands only when points and travel prefer it to the fit that stayed.
  Fit refined(const CentredPose& pose) {
    const FitState polished = polish(fields_, medium_, pose, 4, &iterations_);
    Fit fit = refine(fields_, crossings_, polished, priors_);
    const double turned = std::abs(wrap_pi(fit.state.pose.theta_rad - polished.pose.theta_rad));
    const double left = (fit.state.pose.centre - polished.pose.centre).norm() + turned * fields_.radius_mm();
    if (left < kLeft_mm) return fit;
    Fit stayed = refine(fields_, crossings_, polished, priors_, Start::Close);
    return weight(stayed) > weight(fit) ? stayed : fit;
  }

  double weight(const Fit& fit) const {
    return fit.log_likelihood + path_log_likelihood(gather_evidence(fields_, path_, fit));
  }

  /// Where the scan went one way only, a turn and a latency look alike, and the fit may have settled on a far
  /// pair of them: others along that direction are tried as starts.
  void try_other_latencies() {
    const double variance = fit_.covariance(3, 3);
    const double coupled = fit_.covariance(2, 3) / std::max(variance, 1e-12);
    if (!(std::abs(coupled) * fields_.radius_mm() > kCoupled_mm_per_ms)) return;
    const Fit first = fit_;
    for (const double latency_ms : {-10.0, 0.0, 10.0}) {
      const double by = latency_ms - first.state.latency_ms;
      if (std::abs(by) < 3) continue;
      FitState start;
      start.pose = first.state.pose;
      const Eigen::Vector3d step = by / variance * first.covariance.block<3, 1>(0, 3);
      const double c = std::cos(start.pose.theta_rad), s = std::sin(start.pose.theta_rad);
      start.pose.centre += Vec2(c * step(0) - s * step(1), s * step(0) + c * step(1));
      start.pose.theta_rad = wrap_pi(start.pose.theta_rad + step(2));
      start.latency_ms = latency_ms;
      Fit other = refine(fields_, crossings_, start, priors_, Start::Close);
      // What comes back to the same latency has only settled its members in another way.
      if (std::abs(other.state.latency_ms - first.state.latency_ms) < kSameLatency_ms) continue;
      if (other.log_likelihood > fit_.log_likelihood &&
          same_place(fields_, other.state.pose, first.state.pose))
        fit_ = std::move(other);
    }
  }

  void weigh_rivals() {
    const double found = fit_.log_likelihood + path_log_likelihood(evidence_);
    for (std::size_t i = 1; i < candidates_.size(); ++i) {
      const Candidate& candidate = candidates_[i];
      if (candidates_.front().likelihood - candidate.likelihood > kFarBehind_nats) break;
      if (image_of_found(candidate.state.pose)) continue;
      Rival rival;
      rival.fit = refined(candidate.state.pose);
      if (image_of_found(rival.fit.state.pose)) continue;
      rival.turned = candidate.turned;
      rival.gap_nats =
          found - rival.fit.log_likelihood - path_log_likelihood(gather_evidence(fields_, path_, rival.fit));
      rivals_.push_back(std::move(rival));
    }
    std::stable_sort(rivals_.begin(), rivals_.end(),
                     [](const Rival& a, const Rival& b) { return a.gap_nats < b.gap_nats; });
    if (rivals_.empty() || rivals_.front().gap_nats >= 0) return;
    // The second mode explains the scan better than the first once members and path count: they change
    // places.
    const double gap = rivals_.front().gap_nats;
    std::swap(fit_, rivals_.front().fit);
    rivals_.front().gap_nats = 0;
    for (Rival& rival : rivals_) rival.gap_nats -= gap;
    evidence_ = gather_evidence(fields_, path_, fit_);
  }

  /// Which of two members is off its place: a joint that it has left open shows the sides that the drawing
  /// hides, at another place for the one than for the other.
  void tell_member_off() {
    if (!fit_.either || path_.empty()) return;
    if (fit_.either->apart_mm > options_.max_member_shift_mm + kEitherSlack_mm) return;
    const auto weigh = [&](const Either::Reading& reading) {
      Fit fit = fit_;
      settle_on(fields_, crossings_, reading.estimate, fit);
      return Alternatives(outline_, crossings_, path_, fit, evidence_).whole();
    };
    const Either either = *fit_.either;
    const double gain = weigh(either.first) - weigh(either.second);
    if (std::abs(gain) < kTellsMembers_nats) return;
    settle_on(fields_, crossings_, (gain > 0 ? either.first : either.second).estimate, fit_);
    fit_.either.reset();
    evidence_ = gather_evidence(fields_, path_, fit_);
  }

  const workpiece::OutlineTemplate& outline_;
  const TemplateFields& fields_;
  const std::vector<Crossing>& crossings_;
  const std::vector<bool>& stray_;
  std::span<const PathPiece> path_;
  const LocalizeOptions& options_;
  const StageDone& done_;
  SearchBox box_;
  Priors priors_;
  std::vector<Crossing> medium_;  ///< at most 400, evenly
  int iterations_ = 0;
  std::vector<Candidate> candidates_;
  Fit fit_;
  Evidence evidence_;
  std::vector<Rival> rivals_;
};

}  // namespace

bool solve_robust(const workpiece::OutlineTemplate& outline, const TemplateFields& fields,
                  const Crossings& crossings, std::span<const EdgePoint> edges,
                  std::span<const PathPiece> path, const LocalizeOptions& options, const StageDone& done,
                  Localization& result) {
  return Solver(outline, fields, crossings, path, options, done).run(edges, result);
}

}  // namespace weldcell::localize
