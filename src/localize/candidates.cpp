#include "candidates.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "slips.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::localize {

namespace {

constexpr std::size_t kModes = 8;
/// Steps along members that stand side by side, where few points tell how far along.
constexpr double kSlide_mm = 15;
/// A pose this far beyond the range may still lie in it.
constexpr double kOnTheLimit_mm = 1;
constexpr double kOnTheLimit_rad = rad(0.1);

class Candidates {
 public:
  Candidates(const workpiece::OutlineTemplate& outline, const TemplateFields& fields, const SearchBox& box,
             const std::vector<Crossing>& crossings, int& iterations)
      : outline_(outline), fields_(fields), box_(box), crossings_(crossings), iterations_(iterations) {}

  std::vector<Candidate> run(const std::function<void()>& searched) && {
    std::vector<Crossing> few = sampled(crossings_, kSearchPoints);
    const std::vector<Mode> modes = search(fields_, few, box_, kModes);
    if (!fields_.slips().empty()) few = sampled_both_ways(crossings_, kSearchPoints);
    searched();
    for (const Mode& mode : modes) {
      if (!candidates_.empty() && mode.score < 0.5 * modes.front().score) break;
      consider(few, mode.pose, false);
    }
    // What drifts out of the range is looked at all the same: something lies there, and has a name.
    if (candidates_.empty() && !modes.empty())
      keep(polish(fields_, few, modes.front().pose, 12, &iterations_), false, true);
    if (candidates_.empty()) return {};
    order();
    add_slipped(few);
    const CentredPose straight = candidates_.front().state.pose;
    add_turned(few);
    order();
    if (!same_place(fields_, straight, candidates_.front().state.pose)) add_slipped(few);
    prefer_planned_turn();
    return std::move(candidates_);
  }

 private:
  void consider(const std::vector<Crossing>& few, const CentredPose& from, bool turned) {
    keep(polish(fields_, few, from, turned ? 6 : 12, &iterations_), turned);
  }

  void keep(const FitState& state, bool turned, bool outside_too = false) {
    Candidate candidate{state, 0, turned};
    if (!outside_too && !box_.holds(candidate.state.pose, 12, rad(1.5))) return;
    for (const Candidate& other : candidates_) {
      if (same_place(fields_, other.state.pose, candidate.state.pose)) return;
    }
    candidate.likelihood = rough_log_likelihood(fields_, crossings_, candidate.state);
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

  const workpiece::OutlineTemplate& outline_;
  const TemplateFields& fields_;
  const SearchBox& box_;
  const std::vector<Crossing>& crossings_;
  int& iterations_;
  std::vector<Candidate> candidates_;
};

}  // namespace

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

std::vector<Candidate> collect_candidates(const workpiece::OutlineTemplate& outline,
                                          const TemplateFields& fields, const SearchBox& box,
                                          const std::vector<Crossing>& crossings,
                                          const std::function<void()>& searched, int& iterations) {
  return Candidates(outline, fields, box, crossings, iterations).run(searched);
}

}  // namespace weldcell::localize
