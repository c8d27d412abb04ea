#include "wrong_part.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "weldcell/base/units.hpp"
#include "weldcell/workpiece/departures.hpp"
#include "wording.hpp"

namespace weldcell::localize {

namespace {

/// Another reading of the same points must be this much better to be named as the cause.
constexpr double kClearly_nats = 15;
/// Per point, on average: about two thirds of the points lie on the part.
constexpr double kExplains_nats = 2.7;
constexpr double kNothing_nats = -1e300;
/// What a member set free may gain by chance.
constexpr double kDisplaced_nats = 9;
/// A displaced member gains this much over having been looked for at all its places, on parts of which one in
/// a hundred is wrong, before it is told 10 : 1. No stray point alone gains so much.
constexpr double kFound_nats = 7;
constexpr double kDoubtful_nats = 7;
/// Of three ways round of a dozen members; no stray point alone gains so much.
constexpr double kOver_nats = 10;
/// Passes over an end lie so far off its middle; ends are 30 mm wide and more.
constexpr double kAside_mm = 5;

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

/// A rigid part somewhere and what the points say of it, nats; nothing where it explains them badly.
struct Reading {
  FitState state;
  double nats = kNothing_nats;
};

/// The best fits of these crossings in the box: one that keeps the limits of the job and one that does not.
struct Readings {
  Reading within, beyond;
};
Readings best_readings(const Situation& s, const std::vector<Crossing>& crossings, const SearchBox& box,
                       std::span<const CentredPose> also_from = {}) {
  const std::vector<Crossing> sample = sampled(crossings, 400);
  const std::vector<Crossing> few = sampled(crossings, kSearchPoints);
  const double least = -kExplains_nats * static_cast<double>(sample.size());
  std::vector<CentredPose> starts(also_from.begin(), also_from.end());
  for (const Mode& mode : search(s.fields, crossings, box, 8)) starts.push_back(mode.pose);
  Readings out;
  for (const CentredPose& start : starts) {
    const FitState state = polish(s.fields, few, start, 12, nullptr);
    const double nats = rough_log_likelihood(s.fields, sample, state);
    Pose2 pose{0, 0, state.pose.theta_rad};
    const Vec2 t = state.pose.centre - pose.rotate(s.outline.centroid);
    Reading& best = within_limits(s, {t.x(), t.y(), pose.theta_rad}) ? out.within : out.beyond;
    if (nats > least && nats > best.nats) best = {state, nats};
  }
  return out;
}

/// Where the drawing covers its mirror image, if it is its own one: turned about a principal axis of its
/// edges, of which an axis of symmetry is one. `image` is a pose on mirrored() crossings.
std::vector<CentredPose> covering(const Situation& s, const CentredPose& image) {
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const FieldEdge& e : s.fields.edges()) {
    const Vec2 middle = e.a + 0.5 * e.length_mm * e.direction;
    spread += e.length_mm * (middle * middle.transpose() +
                             e.length_mm * e.length_mm / 12 * e.direction * e.direction.transpose());
  }
  const double axis = 0.5 * std::atan2(2 * spread(0, 1), spread(0, 0) - spread(1, 1));
  std::vector<CentredPose> out;
  for (const double twice : {2 * axis, 2 * axis + kPi}) {
    out.push_back({{image.centre.x(), 2 * s.options.planned.y_mm - image.centre.y()},
                   wrap_pi(-image.theta_rad - twice)});
  }
  return out;
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
  // The mirror line runs through the planned origin, so a part drawn about its origin keeps its place.
  const SearchBox anywhere{{planned, s.options.planned.theta_rad}, reach, kPi, Vec2(-s.outline.centroid)};
  const Readings image = best_readings(s, mirrored(s.crossings, s.options.planned.translation()), anywhere);
  const Reading& mirror = image.within.nats > image.beyond.nats ? image.within : image.beyond;
  const std::vector<CentredPose> covers =
      mirror.nats > kNothing_nats ? covering(s, mirror.state.pose) : std::vector<CentredPose>{};
  const Readings drawn = best_readings(s, s.crossings, anywhere, covers);
  const Reading& outside = drawn.beyond;
  // Members as drawn on either side of the comparison, and each pose where it then fits best.
  const std::vector<Crossing> sample = sampled(s.crossings, 400);
  FitState rigid = s.fit.state;
  std::fill(rigid.members.begin(), rigid.members.end(), MemberShift::Zero());
  const FitState settled = polish(s.fields, sampled(s.crossings, kSearchPoints), rigid.pose, 12, nullptr);
  const double here = std::max({rough_log_likelihood(s.fields, sample, rigid),
                                rough_log_likelihood(s.fields, sample, settled), drawn.within.nats});
  if (std::max(outside.nats, mirror.nats) <= here + kClearly_nats) return false;
  // Two sides of a triangle as drawn and the third off: such a part fits as well, rigid, with another two
  // sides, elsewhere.
  const double displaced = rough_log_likelihood(s.fields, sample, s.fit.state) - kDisplaced_nats;
  if (mirror.nats <= here + kClearly_nats && displaced > outside.nats) return false;
  const double turn = wrap_pi(outside.state.pose.theta_rad - s.options.planned.theta_rad);
  // What a place outside the range explains as well is no mirror image: the drawing may be its own one.
  if (mirror.nats > outside.nats + kAmbiguous_nats) {
    say(result, Verdict::Reject, "mirrored",
        fmt::format("The part is the mirror image of drawing {}. Turn it over or load the mirrored job.",
                    s.outline.name));
    return true;
  }
  const bool either =
      mirror.nats > outside.nats - kAmbiguous_nats && std::abs(turn) > s.options.range_rad + rad(2);
  say(result, Verdict::Reject, "out_of_range",
      fmt::format(
          "The part lies {} and {} away from its planned place, outside the allowed range{}. Move it to "
          "the projected outline and scan again.",
          millimetres((outside.state.pose.centre - planned).norm()), degrees(turn),
          either ? ", or is the mirror image of drawing " + s.outline.name + ", which looks the same" : ""));
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

/// Two passes that tell whether the member lies there, side by side across the side that would move farthest:
/// what one of them does not see may weigh less than a stray point.
void ask_about(const Situation& s, const Alternatives& alternatives, const Displacement& displaced,
               Localization& result) {
  const auto m = static_cast<std::size_t>(displaced.member);
  for (const workpiece::Departure& departure :
       workpiece::shifts(alternatives.members(), m, displaced.shift)) {
    const std::optional<Segment> pass = workpiece::telling_pass(alternatives.members(), departure);
    if (!pass) continue;
    const Vec2 aside = kAside_mm * Vec2(-departure.outward.y(), departure.outward.x());
    result.rescan.push_back({s.outline.member_names[m], pass->a + aside, pass->b + aside});
    result.rescan.push_back({s.outline.member_names[m], pass->b - aside, pass->a - aside});
    return;
  }
}

/// A member that points and travel find turned over in its place, by more than so many nats.
std::optional<int> turned_over(const Situation& s, const Alternatives& alternatives, double nats) {
  for (int m = 0; m < static_cast<int>(s.evidence.members.size()); ++m) {
    const auto member = static_cast<std::size_t>(m);
    for (const workpiece::Departure& d : workpiece::turned_over(alternatives.members(), member)) {
      if (alternatives.most_gain(d.reach) > nats && !alternatives.refutes(member, d.instead, d.reach, -nats))
        return m;
    }
  }
  return std::nullopt;
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
  if (const auto over = turned_over(s, alternatives, std::max({kOver_nats, best.gain_nats, without}))) {
    say(result, Verdict::Reject, "wrong_revision",
        fmt::format(
            "{} lies turned over or end for end in its place. Turn it round, or check the part against "
            "drawing {}.",
            member_name(s, *over), s.outline.name));
    return true;
  }
  if (best.gain_nats >= kDoubtful_nats && best.gain_nats > without) {
    const std::string& name = member_name(s, best.member);
    // What little evidence may still be chance: looking again settles it.
    const bool sure = best.gain_nats >= kFound_nats + alternatives.places_nats();
    if (!sure) ask_about(s, alternatives, best, result);
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
  // What the fit followed to its place is off, not missing.
  if (without < 0 && member_off(s, result)) return true;
  say(result, without >= kDisplaced_nats ? Verdict::Reject : Verdict::Rescan, "member_missing",
      fmt::format("{} was not seen although the scan passed over its place. Put it in place and scan again.",
                  member_name(s, unseen.front())));
  return true;
}

}  // namespace

void say(Localization& result, Verdict verdict, const char* cause, std::string reason) {
  result.verdict = verdict;
  result.cause = cause;
  result.reason = std::move(reason);
}

const std::string& member_name(const Situation& s, int member) {
  return s.outline.member_names[static_cast<std::size_t>(member)];
}

bool within_limits(const Situation& s, const Pose2& pose) {
  Offset off = offset_from_planned(s.outline, s.options.planned, pose);
  const double dx = pose.x_mm - s.options.planned.x_mm, dy = pose.y_mm - s.options.planned.y_mm;
  if (std::max(std::abs(dx), std::abs(dy)) < std::max(std::abs(off.dx_mm), std::abs(off.dy_mm))) {
    off.dx_mm = dx;
    off.dy_mm = dy;
  }
  const auto keeps = [](double value, double limit, double slack) {
    return std::abs(value) <= 1.02 * limit + slack;
  };
  return keeps(off.dx_mm, s.options.max_offset_mm, 0.5) && keeps(off.dy_mm, s.options.max_offset_mm, 0.5) &&
         keeps(off.dtheta_rad, s.options.max_rotation_rad, rad(0.1));
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

}  // namespace weldcell::localize
