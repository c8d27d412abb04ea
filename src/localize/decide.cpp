#include "decide.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>

#include "alternatives.hpp"
#include "chance.hpp"
#include "proof.hpp"
#include "weldcell/base/units.hpp"
#include "wording.hpp"

namespace weldcell::localize {

namespace {

/// Odds of about 1000 : 1.
constexpr double kAmbiguous_nats = 7;
/// Another reading of the same points must be this much better to be named as the cause.
constexpr double kClearly_nats = 15;
/// Per point, on average: about two thirds of the points lie on the part.
constexpr double kExplains_nats = 2.7;
constexpr double kNothing_nats = -1e300;
/// One of some hundred places of some members, on a part that is hardly ever wrong.
constexpr double kDisplaced_nats = 9;
constexpr double kDoubtful_nats = 7;
constexpr double kMinInlierShare = 0.35;
constexpr double kMinRate = 0.5;
/// What a pose must be known to when no weld says so more exactly, and how likely it may be farther off:
/// asked for more, every third part of two members within its tolerance would be refused.
constexpr double kPoseBound_mm = 1.0;
constexpr double kPoseBound_rad = rad(0.2);
constexpr double kMostFartherOff = 0.09;
/// A pose with a longer tail than this (1 sigma) is not placed, however unlikely the tail.
constexpr double kMostSigma_mm = 0.75;

void say(Localization& result, Verdict verdict, const char* cause, std::string reason) {
  result.verdict = verdict;
  result.cause = cause;
  result.reason = std::move(reason);
}

const std::string& member_name(const Situation& s, int member) {
  return s.outline.member_names[static_cast<std::size_t>(member)];
}

/// Whether the found pose leaves anything to explain.
bool suspicious(const Situation& s, const Localization& result) {
  if (result.inliers < 0.6 * static_cast<double>(s.crossings.size())) return true;
  if (!s.evidence.has_path) {
    return std::any_of(s.fit.member_points.begin(), s.fit.member_points.end(), [](int n) { return n == 0; });
  }
  if (s.evidence.seen < 0.85 * s.evidence.expected) return true;
  return std::any_of(s.evidence.members.begin(), s.evidence.members.end(),
                     [](const MemberEvidence& m) { return m.expected >= 3 && m.seen < 0.6 * m.expected; });
}

/// The best fit of these crossings anywhere in the box: its log-likelihood, or nothing when it explains them
/// badly.
double best_elsewhere(const Situation& s, const std::vector<Crossing>& crossings, const SearchBox& box,
                      FitState* found) {
  const std::vector<Crossing> sample = sampled(crossings, 400);
  const std::vector<Crossing> few = sampled(crossings, kSearchPoints);
  double best = kNothing_nats;
  for (const Mode& mode : search(s.fields, crossings, box, 8)) {
    const FitState state = polish(s.fields, few, mode.pose, 12, nullptr);
    const double likelihood = rough_log_likelihood(s.fields, sample, state);
    if (likelihood <= best) continue;
    best = likelihood;
    *found = state;
  }
  return best > -kExplains_nats * static_cast<double>(sample.size()) ? best : kNothing_nats;
}

std::vector<Crossing> mirrored(const std::vector<Crossing>& crossings, const Vec2& about) {
  std::vector<Crossing> out = crossings;
  for (Crossing& c : out) {
    c.point.y() = 2 * about.y() - c.point.y();
    c.direction.y() = -c.direction.y();
    c.inward.y() = -c.inward.y();
    c.inward_rad = -c.inward_rad;
  }
  return out;
}

/// Whether the mirror image of the part, or the part outside the allowed range, explains the points clearly
/// better.
bool explained_elsewhere(const Situation& s, Localization& result) {
  const Vec2 planned = s.options.planned * s.outline.centroid;
  const double reach = std::min(1.5 * s.options.range_mm + 50, 400.0);
  // Members as drawn on either side of the comparison, and each pose where it then fits best.
  const std::vector<Crossing> sample = sampled(s.crossings, 400);
  FitState rigid = s.fit.state;
  std::fill(rigid.members.begin(), rigid.members.end(), MemberShift::Zero());
  const FitState settled = polish(s.fields, sampled(s.crossings, kSearchPoints), rigid.pose, 12, nullptr);
  const double here = kClearly_nats + std::max(rough_log_likelihood(s.fields, sample, rigid),
                                               rough_log_likelihood(s.fields, sample, settled));
  // The mirror line runs through the planned origin, so a part drawn about its origin keeps its place.
  const SearchBox anywhere{{planned, s.options.planned.theta_rad}, reach, kPi, Vec2(-s.outline.centroid)};
  FitState outside, mirror;
  const double of_outside = best_elsewhere(s, s.crossings, anywhere, &outside);
  const double of_mirror =
      best_elsewhere(s, mirrored(s.crossings, s.options.planned.translation()), anywhere, &mirror);
  if (std::max(of_outside, of_mirror) <= here) return false;
  const double turn = wrap_pi(outside.pose.theta_rad - s.options.planned.theta_rad);
  // What a place outside the range explains as well is no mirror image: the drawing may be its own one.
  if (of_mirror > of_outside + kAmbiguous_nats) {
    say(result, Verdict::Reject, "mirrored",
        fmt::format("The part is the mirror image of drawing {}. Turn it over or load the mirrored job.",
                    s.outline.name));
    return true;
  }
  const bool either =
      of_mirror > of_outside - kAmbiguous_nats && std::abs(turn) > s.options.range_rad + rad(2);
  say(result, Verdict::Reject, "out_of_range",
      fmt::format(
          "The part lies {} and {} away from its planned place, outside the allowed range{}. Move it to "
          "the projected outline and scan again.",
          millimetres((outside.pose.centre - planned).norm()), degrees(turn),
          either ? ", or is the mirror image of drawing " + s.outline.name + ", which looks the same" : ""));
  return true;
}

/// A member that points and travel find at another place, or not at all.
bool member_elsewhere(const Situation& s, const Alternatives& alternatives, Localization& result) {
  const std::vector<int> unseen = unseen_members(s.evidence);
  Displacement best;
  for (int m = 0; m < static_cast<int>(s.evidence.members.size()); ++m) {
    const bool hardly_seen = std::find(unseen.begin(), unseen.end(), m) != unseen.end();
    const Displacement d = alternatives.displaced(m, hardly_seen);
    if (d.gain_nats > best.gain_nats) best = d;
  }
  double without = kNothing_nats;
  if (!unseen.empty()) without = alternatives.missing(unseen.front());
  if (best.gain_nats >= kDoubtful_nats && best.gain_nats > without) {
    const std::string& name = member_name(s, best.member);
    // What little evidence may still be chance: looking again settles it.
    const bool sure = best.gain_nats >= kDisplaced_nats;
    say(result, sure ? Verdict::Reject : Verdict::Rescan, "wrong_revision",
        best.own_points > 0
            ? fmt::format(
                  "{} {} {} of its place on the drawing: another revision, or set up wrong. Check the part "
                  "against drawing {}.",
                  name, sure ? "lies" : "seems to lie", direction_on_drawing(best.shift), s.outline.name)
            : fmt::format(
                  "The joint of {} {} open: it is shorter than drawn, or not in its place. Check the part "
                  "against drawing {}.",
                  name, sure ? "stands" : "seems to stand", s.outline.name));
    return true;
  }
  if (unseen.empty()) return false;
  say(result, without >= kDisplaced_nats ? Verdict::Reject : Verdict::Rescan, "member_missing",
      fmt::format("{} was not seen although the scan passed over its place. Put it in place and scan again.",
                  member_name(s, unseen.front())));
  return true;
}

bool member_off(const Situation& s, Localization& result) {
  if (const auto& either = s.fit.either;
      either && either->apart_mm > s.options.max_member_shift_mm + kEitherSlack_mm) {
    say(result, Verdict::Reject, "wrong_revision",
        fmt::format(
            "{} or {} lies {} off its place on the drawing, more than the allowed {}. Set it right or "
            "check the revision of drawing {}.",
            member_name(s, either->first.member), member_name(s, either->second.member),
            millimetres(either->apart_mm), millimetres(s.options.max_member_shift_mm), s.outline.name));
    return true;
  }
  for (std::size_t m = 0; m < result.members.size(); ++m) {
    const MemberPose& pose = result.members[m];
    if (pose.points < 2) continue;
    const double off = std::hypot(pose.dx_mm, pose.dy_mm);
    if (off <= s.options.max_member_shift_mm + 2 * std::min(pose.sigma_mm, 0.5)) continue;
    const Vec2 on_drawing = Pose2{0, 0, -result.pose.theta_rad}.rotate({pose.dx_mm, pose.dy_mm});
    say(result, Verdict::Reject, "wrong_revision",
        fmt::format(
            "{} lies {} of its place on the drawing, more than the allowed {}. Set it right or check the "
            "revision of drawing {}.",
            pose.name, direction_on_drawing(on_drawing), millimetres(s.options.max_member_shift_mm),
            s.outline.name));
    return true;
  }
  return false;
}

bool wrong_part(const Situation& s, const Alternatives* alternatives, Localization& result) {
  const bool looked = suspicious(s, result);
  if (looked && explained_elsewhere(s, result)) return true;
  if (!(alternatives != nullptr && member_elsewhere(s, *alternatives, result)) && !member_off(s, result))
    return false;
  // A nearly symmetric part turned by half a turn fits but for a member or two.
  if (!looked) explained_elsewhere(s, result);
  return true;
}

/// What could be other than drawn without this scan having shown it.
bool not_looked_at(const Situation& s, const Alternatives& alternatives, Localization& result) {
  const std::vector<Unproven> open = unproven(s, alternatives);
  if (open.empty()) return false;
  for (const Unproven& u : open) {
    const auto m = static_cast<std::size_t>(u.departure.member);
    result.rescan.push_back({s.outline.member_names[m], u.pass.a, u.pass.b});
  }
  const Unproven& first = open.front();
  const std::string more =
      open.size() > 1 ? fmt::format(", and {} more line{}", open.size() - 1, open.size() > 2 ? "s" : "") : "";
  say(result, Verdict::Rescan, "not_looked_at",
      fmt::format(
          "The {} was not looked at: it could be off by {} without the scan showing it. Scan across it "
          "from ({:.0f}, {:.0f}) to ({:.0f}, {:.0f}) on the drawing{}.",
          place_name(s.outline, first.departure), millimetres(s.options.prove_shift_mm), first.pass.a.x(),
          first.pass.a.y(), first.pass.b.x(), first.pass.b.y(), more));
  return true;
}

/// The edge whose crossing would tell most about the worst known direction.
int most_telling_edge(const Situation& s, const Eigen::Matrix3d& covariance_part) {
  int best = 0;
  double gain = -1;
  for (std::size_t e = 0; e < s.fields.edges().size(); ++e) {
    const FieldEdge& edge = s.fields.edges()[e];
    const Vec2 middle = edge.a + 0.5 * edge.length_mm * edge.direction;
    const Vec2& n = edge.outward;
    const Eigen::Vector3d a(n.x(), n.y(), n.y() * middle.x() - n.x() * middle.y());
    const double here = a.dot(covariance_part * a) * std::min(1.0, edge.length_mm / 100);
    if (here <= gain) continue;
    gain = here;
    best = static_cast<int>(e);
  }
  return best;
}

bool too_vague(const Situation& s, Localization& result) {
  const Eigen::Matrix2d xy = result.covariance.topLeftCorner<2, 2>();
  const double largest = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(xy).eigenvalues()(1);
  const double sigma_rad = std::sqrt(result.covariance(2, 2));
  // Of two readings that lie apart the unlikelier one is not passed over.
  const double most_sigma = s.fit.either ? 0.5 * kPoseBound_mm : kMostSigma_mm;
  // A covariance that rounding has left without a positive determinant proves nothing either.
  const bool proven = result.covariance.allFinite() && largest <= most_sigma * most_sigma &&
                      Eigen::LLT<Eigen::Matrix3d>(result.covariance).info() == Eigen::Success;
  const double bound_rad = std::max(kPoseBound_rad, 1.0 / std::max(s.outline.radius_mm, 1.0));
  if (proven && chance_beyond(s.fit.chances, kPoseBound_mm, bound_rad) <= kMostFartherOff) return false;
  if (const auto& either = s.fit.either) {
    say(result, Verdict::Rescan, "not_enough",
        fmt::format("{} or {} lies {} off its place on the drawing, and the scan does not tell which. Scan "
                    "across the joints of both, or set it right.",
                    member_name(s, either->first.member), member_name(s, either->second.member),
                    millimetres(either->apart_mm)));
    return true;
  }
  const int edge = most_telling_edge(s, s.fit.covariance.topLeftCorner<3, 3>());
  say(result, Verdict::Rescan, "not_enough",
      fmt::format("Not enough was seen to place the part (known to {} and {}). Scan across the {} again.",
                  millimetres(2 * std::sqrt(std::max(largest, 0.0))), degrees(2 * sigma_rad),
                  edge_name(s.outline, edge)));
  return true;
}

/// How many points may be there by chance, among those that tell about one direction: clutter meets an edge
/// now and then, and the search picks the place where it does so most. The travel speaks against most such
/// places.
std::size_t by_chance(const Situation& s, int inliers) {
  const std::size_t outliers = s.crossings.size() - static_cast<std::size_t>(inliers);
  return s.evidence.has_path ? 1 + outliers / 16 : 2 + outliers / 8;
}

/// Whether some direction of the pose (shift, or turn as the shift of the farthest point) hangs on points
/// that may be there by chance: without the most telling ones less than kMustRemain whole points tell about
/// it.
bool hangs_on_few(const Situation& s, Localization& result) {
  constexpr double kMustRemain = 2;
  const double radius = std::max(s.outline.radius_mm, 1.0);
  std::vector<Eigen::Vector3d> rows;
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < s.fit.matches.size(); ++i) {
    const Match& m = s.fit.matches[i];
    if (m.edge < 0 || s.fit.inlier[i] <= 0.5) continue;
    const Vec2& n = s.fields.edges()[static_cast<std::size_t>(m.edge)].outward;
    rows.emplace_back(n.x(), n.y(), (n.y() * m.place.x() - n.x() * m.place.y()) / radius);
    information += rows.back() * rows.back().transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(information);
  const std::size_t chance = std::min(by_chance(s, result.inliers), rows.size());
  for (int k = 0; k < 3; ++k) {
    std::vector<double> tells;
    tells.reserve(rows.size());
    for (const Eigen::Vector3d& row : rows) {
      const double along = row.dot(axes.eigenvectors().col(k));
      tells.push_back(along * along);
    }
    std::nth_element(tells.begin(), tells.begin() + static_cast<std::ptrdiff_t>(chance), tells.end(),
                     std::greater<>());
    if (std::accumulate(tells.begin() + static_cast<std::ptrdiff_t>(chance), tells.end(), 0.0) >= kMustRemain)
      continue;
    const Eigen::Vector3d open = axes.eigenvectors().col(k).cwiseProduct(Eigen::Vector3d(1, 1, 1 / radius));
    const int edge = most_telling_edge(s, open * open.transpose());
    say(result, Verdict::Rescan, "not_enough",
        fmt::format(
            "Too few points tell where the part lies in one direction, so that a stray one could shift "
            "it. Scan across the {} again.",
            edge_name(s.outline, edge)));
    return true;
  }
  return false;
}

bool ambiguous(const Situation& s, Localization& result) {
  for (const Rival& rival : s.rivals) {
    if (rival.gap_nats >= kAmbiguous_nats) continue;
    const double turn = wrap_pi(rival.fit.state.pose.theta_rad - s.fit.state.pose.theta_rad);
    const double off = (rival.fit.state.pose.centre - s.fit.state.pose.centre).norm();
    say(result, Verdict::Rescan, "ambiguous",
        fmt::format(
            "The part fits as well turned by {} and {} aside. Scan all members once more, or place it closer "
            "to the projected outline.",
            degrees(turn), millimetres(off)));
    return true;
  }
  return false;
}

bool out_of_range(const Situation& s, Localization& result) {
  Offset off = offset_from_planned(s.outline, s.options.planned, result.pose);
  // A part whose centroid or whose origin keeps the limits keeps them.
  const double dx = result.pose.x_mm - s.options.planned.x_mm, dy = result.pose.y_mm - s.options.planned.y_mm;
  if (std::max(std::abs(dx), std::abs(dy)) < std::max(std::abs(off.dx_mm), std::abs(off.dy_mm))) {
    off.dx_mm = dx;
    off.dy_mm = dy;
  }
  const auto beyond = [](double value, double limit, double slack) {
    return std::abs(value) > 1.02 * limit + slack;
  };
  if (!beyond(off.dx_mm, s.options.max_offset_mm, 0.5) && !beyond(off.dy_mm, s.options.max_offset_mm, 0.5) &&
      !beyond(off.dtheta_rad, s.options.max_rotation_rad, rad(0.1))) {
    return false;
  }
  say(result, Verdict::Reject, "out_of_range",
      fmt::format("The part lies {} and {} away from its planned place; {} and {} are allowed. Move it to "
                  "the projected "
                  "outline and scan again.",
                  millimetres(std::hypot(off.dx_mm, off.dy_mm)), degrees(off.dtheta_rad),
                  millimetres(s.options.max_offset_mm), degrees(s.options.max_rotation_rad)));
  return true;
}

}  // namespace

double path_log_likelihood(const Evidence& evidence) {
  if (!evidence.has_path) return 0;
  // A crossing is missed with a chance of about one in twelve.
  return -2.5 * (evidence.expected - evidence.seen);
}

void decide(const Situation& s, Localization& result) {
  const auto total = static_cast<double>(s.crossings.size());
  std::optional<Alternatives> alternatives;
  if (s.options.full_reject_checks && s.evidence.has_path)
    alternatives.emplace(s.outline, s.crossings, s.path, s.fit, s.evidence);
  if (s.options.full_reject_checks && wrong_part(s, alternatives ? &*alternatives : nullptr, result)) return;
  if (result.inliers < kMinInlierShare * total || (s.evidence.has_path && s.evidence.rate < kMinRate)) {
    say(result, Verdict::Reject, "clutter",
        fmt::format("Only {} of {} edge points lie on the part as drawn. Clear the table of other things, "
                    "check that it "
                    "is part {}, and scan again.",
                    result.inliers, s.crossings.size(), s.outline.name));
    return;
  }
  if (too_vague(s, result) || hangs_on_few(s, result)) return;
  if (s.options.full_reject_checks && ambiguous(s, result)) return;
  if (out_of_range(s, result)) return;
  if (alternatives && s.options.prove_shift_mm > 0 && not_looked_at(s, *alternatives, result)) return;
  say(result, Verdict::Weld, "ok",
      fmt::format("The part was found with {} of {} edge points; its place is known to {} and {}.",
                  result.inliers, s.crossings.size(),
                  millimetres(2 * std::sqrt(std::max(result.covariance(0, 0), result.covariance(1, 1)))),
                  fmt::format("{:.3f} deg", deg(2 * std::sqrt(result.covariance(2, 2))))));
}

}  // namespace weldcell::localize
