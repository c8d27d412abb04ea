#include "solver.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "alternatives.hpp"
#include "decide.hpp"
#include "evidence.hpp"
#include "fit.hpp"
#include "search.hpp"
#include "slips.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::localize {

namespace {

constexpr std::size_t kModes = 8;
/// Beyond this a second mode need not be looked at more closely.
constexpr double kFarBehind_nats = 40;
/// Steps along members that stand side by side, where few points tell how far along.
constexpr double kSlide_mm = 15;
/// A pose this far beyond the range may still lie in it.
constexpr double kOnTheLimit_mm = 1;
constexpr double kOnTheLimit_rad = rad(0.1);
/// Members within their tolerances lead a fit less far from where it started.
constexpr double kLeft_mm = 3;
/// A millisecond that looks like so much turn at the farthest point is told apart from it by little.
constexpr double kCoupled_mm_per_ms = 0.05;
constexpr double kSameLatency_ms = 1;
/// At least two points, so that no stray one alone tells which of two members is off.
constexpr double kTellsMembers_nats = 12;

Pose2 part_pose(const workpiece::OutlineTemplate& outline, const CentredPose& centred) {
  Pose2 pose{0, 0, centred.theta_rad};
  const Vec2 t = centred.centre - pose.rotate(outline.centroid);
  return {t.x(), t.y(), centred.theta_rad};
}

CentredPose centred_pose(const workpiece::OutlineTemplate& outline, const Pose2& pose) {
  return {pose * outline.centroid, pose.theta_rad};
}

bool same_place(const TemplateFields& fields, const CentredPose& a, const CentredPose& b) {
  return (a.centre - b.centre).norm() < 5 &&
         std::abs(wrap_pi(a.theta_rad - b.theta_rad)) * fields.radius_mm() < 10;
}

struct Candidate {
  FitState state;
  double likelihood = 0;
  bool turned = false;
};

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
    collect_candidates();
    end(Stage::Polish);
    if (candidates_.empty()) return false;
    fit_ = refined(candidates_.front().state.pose);
    try_other_latencies();
    end(Stage::Refine);
    evidence_ = gather_evidence(fields_, path_, fit_);
    weigh_rivals();
    end(Stage::Rivals);
    tell_member_off();
    fill(result);
    fill_points(edges, result);
    decide({outline_, fields_, options_, crossings_, path_, fit_, evidence_, rivals_}, result);
    end(Stage::Verdict);
    return true;
  }

 private:
  void end(Stage stage) const {
    if (done_) done_(stage);
  }

  void collect_candidates() {
    std::vector<Crossing> few = sampled(medium_, kSearchPoints);
    const std::vector<Mode> modes = search(fields_, few, box_, kModes);
    if (!fields_.slips().empty()) few = sampled_both_ways(medium_, kSearchPoints);
    end(Stage::Search);
    for (const Mode& mode : modes) {
      if (!candidates_.empty() && mode.score < 0.5 * modes.front().score) break;
      consider(few, mode.pose, false);
    }
    // What drifts out of the range is looked at all the same: something lies there, and has a name.
    if (candidates_.empty() && !modes.empty())
      keep(polish(fields_, few, modes.front().pose, 12, &iterations_), false, true);
    if (candidates_.empty()) return;
    order();
    add_slipped(few);
    const CentredPose straight = candidates_.front().state.pose;
    add_turned(few);
    order();
    if (!same_place(fields_, straight, candidates_.front().state.pose)) add_slipped(few);
    prefer_planned_turn();
  }

  void consider(const std::vector<Crossing>& few, const CentredPose& from, bool turned) {
    keep(polish(fields_, few, from, turned ? 6 : 12, &iterations_), turned);
  }

  void keep(const FitState& state, bool turned, bool outside_too = false) {
    Candidate candidate{state, 0, turned};
    if (!outside_too && !box_.holds(candidate.state.pose, 12, rad(1.5))) return;
    for (const Candidate& other : candidates_) {
      if (same_place(fields_, other.state.pose, candidate.state.pose)) return;
    }
    candidate.likelihood = rough_log_likelihood(fields_, medium_, candidate.state);
    candidates_.push_back(std::move(candidate));
  }

  void order() {
    std::stable_sort(candidates_.begin(), candidates_.end(),
                     [](const Candidate& a, const Candidate& b) { return a.likelihood > b.likelihood; });
  }

  /// Where members stand side by side at nearly one pitch, the search may be off by some of them, or along
  /// them.
  void add_slipped(const std::vector<Crossing>& few) {
    for (bool better = !fields_.slips().empty(); better;) {
      const Candidate from = candidates_.front();
      const double least = rough_log_likelihood(fields_, few, from.state) - kFarBehind_nats;
      const Pose2 turn{0, 0, from.state.pose.theta_rad};
      for (const Vec2& slip : fields_.slips()) {
        const Vec2 along = turn.rotate(slip), across = kSlide_mm * Vec2(-along.y(), along.x()).normalized();
        for (const int steps : {-3, -2, -1, 1, 2, 3}) try_at(few, from.state.pose, steps * along, least);
        for (const int steps : {-2, -1, 1, 2}) try_at(few, from.state.pose, steps * across, least);
      }
      order();
      better = candidates_.front().likelihood > from.likelihood;
    }
  }

  void try_at(const std::vector<Crossing>& few, CentredPose from, const Vec2& shift, double least) {
    from.centre += shift;
    const FitState state = polish(fields_, few, from, 12, &iterations_);
    if (rough_log_likelihood(fields_, few, state) >= least) keep(state, false);
  }

  /// The near-symmetric images of the best pose, where the range admits them.
  void add_turned(const std::vector<Crossing>& few) {
    const Pose2 best = part_pose(outline_, candidates_.front().state.pose);
    for (const workpiece::Symmetry& symmetry : outline_.symmetries) {
      if (symmetry.gap_mm == 0) continue;
      const CentredPose turned = centred_pose(outline_, best * symmetry.map);
      if (box_.holds(turned, 12, rad(1.5))) consider(few, turned, true);
    }
  }

  /// Of the images under true symmetries, which no scan can tell apart, one that lies in the range, and of
  /// these the one least turned from planned.
  void prefer_planned_turn() {
    const Pose2 best = part_pose(outline_, candidates_.front().state.pose);
    CentredPose& chosen = candidates_.front().state.pose;
    const auto before = [&](const CentredPose& a, const CentredPose& b) {
      const bool a_held = box_.holds(a, kOnTheLimit_mm, kOnTheLimit_rad),
                 b_held = box_.holds(b, kOnTheLimit_mm, kOnTheLimit_rad);
      if (a_held != b_held) return a_held;
      return std::abs(wrap_pi(a.theta_rad - box_.planned.theta_rad)) <
             std::abs(wrap_pi(b.theta_rad - box_.planned.theta_rad)) - 1e-6;
    };
    for (const workpiece::Symmetry& symmetry : outline_.symmetries) {
      if (symmetry.gap_mm != 0) continue;
      const CentredPose image = centred_pose(outline_, best * symmetry.map);
      if (before(image, chosen)) chosen = image;
    }
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

  void fill(Localization& result) const {
    result.pose = part_pose(outline_, fit_.state.pose);
    result.centroid_base = fit_.state.pose.centre;
    const Pose2 turn{0, 0, result.pose.theta_rad};
    Eigen::Matrix3d to_base = Eigen::Matrix3d::Identity();
    to_base.topLeftCorner<2, 2>() << std::cos(turn.theta_rad), -std::sin(turn.theta_rad),
        std::sin(turn.theta_rad), std::cos(turn.theta_rad);
    result.covariance = to_base * fit_.covariance.topLeftCorner<3, 3>() * to_base.transpose();
    const bool timed =
        priors_.latency_ms > 0 &&
        std::any_of(crossings_.begin(), crossings_.end(), [](const Crossing& c) { return c.speed_mm_s > 0; });
    if (timed) result.latency_s = 1e-3 * fit_.state.latency_ms;
    result.inset_mm = fit_.state.inset_mm;
    result.iterations = iterations_ + fit_.iterations;
    for (const Rival& rival : rivals_) {
      if (rival.gap_nats < kFarBehind_nats) {
        result.alternatives.push_back({part_pose(outline_, rival.fit.state.pose), mean_distance(rival.fit)});
      }
    }
    fill_members(result, to_base);
  }

  /// Edge and residual of every point given, also of those that stood twice or were too many for the fit.
  void fill_points(std::span<const EdgePoint> edges, Localization& result) const {
    result.points = static_cast<int>(edges.size());
    result.edge_of_point.assign(edges.size(), -1);
    result.residual_mm.assign(edges.size(), 0);
    if (crossings_.size() < edges.size()) describe_all(edges, result);
    for (std::size_t i = 0; i < crossings_.size(); ++i) {
      const auto source = static_cast<std::size_t>(crossings_[i].source);
      result.edge_of_point[source] = fit_.inlier[i] > 0.5 ? fit_.matches[i].edge : -1;
      result.residual_mm[source] = fit_.matches[i].edge >= 0 ? fit_.matches[i].residual_mm : 0;
      result.inliers += fit_.inlier[i] > 0.5;
    }
    result.mean_error_mm = mean_distance(fit_);
  }

  void describe_all(std::span<const EdgePoint> edges, Localization& result) const {
    const double c = std::cos(result.pose.theta_rad), s = std::sin(result.pose.theta_rad);
    for (std::size_t i = 0; i < edges.size(); ++i) {
      const Crossings one = ready_crossings(edges.subspan(i, 1), options_.default_sigma_mm);
      if (one.list.empty() || (!stray_.empty() && stray_[i])) continue;
      const Match m = match(fields_, one.list.front(), fit_.state.pose, c, s);
      if (m.edge < 0) continue;
      result.residual_mm[i] = m.residual_mm;
      if (m.distance_mm <= 4 * fit_.scale * one.list.front().sigma_mm) result.edge_of_point[i] = m.edge;
    }
  }

  double mean_distance(const Fit& fit) const {
    double sum = 0;
    for (const Match& m : fit.matches) sum += m.edge < 0 ? TemplateFields::kReach_mm : m.distance_mm;
    return sum / static_cast<double>(fit.matches.size());
  }

  void fill_members(Localization& result, const Eigen::Matrix3d& to_base) const {
    for (std::size_t m = 0; m < outline_.members.size(); ++m) {
      MemberPose pose;
      pose.name = outline_.member_names[m];
      const Eigen::Vector3d shift = to_base * fit_.state.members[m];
      pose.dx_mm = shift.x();
      pose.dy_mm = shift.y();
      pose.dtheta_rad = shift.z();
      pose.covariance = to_base * fit_.member_covariance[m] * to_base.transpose();
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(
          Eigen::Matrix2d(pose.covariance.topLeftCorner<2, 2>()));
      pose.sigma_mm = std::sqrt(std::max(0.0, axes.eigenvalues()(1)));
      pose.points = fit_.member_points[m];
      result.members.push_back(std::move(pose));
    }
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
