#include "proof.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "wording.hpp"

namespace weldcell::localize {

namespace {

using workpiece::Departure;

/// Points that hold one side where it is; more are not looked at.
constexpr std::size_t kEnough = 2;
/// Also asked where prove_shift_mm is less.
constexpr double kFarther_mm = 20;
/// Passes that say the same: of a turn and a side, say, of one member.
constexpr double kSamePass_mm = 15;

/// A point nearer to a corner may lie on either side.
constexpr double kCorner_mm = 3;

/// Places of the points that lie on each side of each member, those at its corners left out.
class PointsOnSides {
 public:
  explicit PointsOnSides(const Situation& s) : sides_(s.outline.members.size()) {
    for (std::size_t m = 0; m < sides_.size(); ++m) sides_[m].resize(s.outline.members[m].size());
    for (std::size_t i = 0; i < s.fit.matches.size(); ++i) {
      if (s.fit.matches[i].edge < 0 || s.fit.inlier[i] <= 0.5) continue;
      const workpiece::VisibleEdge& e = s.outline.edges[static_cast<std::size_t>(s.fit.matches[i].edge)];
      const Vec2 place = s.fit.matches[i].place + s.outline.centroid;
      const Polygon& outline = s.outline.members[static_cast<std::size_t>(e.member)];
      const auto side = static_cast<std::size_t>(e.side);
      if ((place - outline[side]).norm() < kCorner_mm ||
          (place - outline[(side + 1) % outline.size()]).norm() < kCorner_mm)
        continue;
      sides_[static_cast<std::size_t>(e.member)][side].push_back(place);
    }
  }
  const std::vector<Vec2>& on(int member, std::size_t side) const {
    return sides_[static_cast<std::size_t>(member)][side];
  }
  std::size_t sides(int member) const { return sides_[static_cast<std::size_t>(member)].size(); }

 private:
  std::vector<std::vector<std::vector<Vec2>>> sides_;
};

bool on_a_side(const Vec2& place, const Polygon& outline) {
  for (std::size_t k = 0; k < outline.size(); ++k) {
    if (distance(place, Segment{outline[k], outline[(k + 1) % outline.size()]}) < kCorner_mm) return true;
  }
  return false;
}

/// Whether points on the member's own sides alone speak against the departure: on the side that moves, on
/// ends of a shifted member, on long sides in the half that swings, or where one turned over has no side.
bool held_by_points(const Departure& departure, const Polygon& outline, const PointsOnSides& points) {
  const Vec2 middle = centroid(outline);
  std::size_t count = 0;
  for (std::size_t k = 0; k < points.sides(departure.member); ++k) {
    const std::vector<Vec2>& on = points.on(departure.member, k);
    if (on.empty()) continue;
    if (departure.over) {
      count += static_cast<std::size_t>(std::count_if(
          on.begin(), on.end(), [&](const Vec2& p) { return !on_a_side(p, departure.instead); }));
    } else if (departure.whole) {
      if (workpiece::is_end(outline, k)) count += on.size();
    } else if (departure.side >= 0) {
      if (departure.side == static_cast<int>(k)) count += on.size();
    } else if (!workpiece::is_end(outline, k)) {
      count += static_cast<std::size_t>(std::count_if(
          on.begin(), on.end(), [&](const Vec2& p) { return (p - middle).dot(departure.outward) > 0; }));
    }
  }
  return count >= kEnough;
}

bool alike(const Segment& a, const Segment& b) {
  return (a.a - b.a).norm() + (a.b - b.b).norm() < kSamePass_mm ||
         (a.a - b.b).norm() + (a.b - b.a).norm() < kSamePass_mm;
}

/// What one member could be without the scan having shown it; `visible` are its edges on the drawing.
void add_unproven(const Situation& s, const Alternatives& alternatives, const PointsOnSides& points,
                  double by_mm, std::size_t m, std::span<const workpiece::VisibleEdge> visible,
                  std::vector<Unproven>& out) {
  const std::vector<Polygon>& members = alternatives.members();
  for (Departure& departure : workpiece::departures(members, visible, m, by_mm, s.options.prove_free_ends)) {
    if (held_by_points(departure, members[m], points)) continue;
    if (alternatives.refutes(m, departure.instead, departure.reach, kRefuted_nats)) continue;
    const std::optional<Segment> pass = workpiece::telling_pass(members, departure);
    if (!pass || std::any_of(out.begin(), out.end(), [&](const Unproven& u) { return alike(u.pass, *pass); }))
      continue;
    out.push_back({std::move(departure), *pass});
  }
}

}  // namespace

std::vector<Unproven> unproven(const Situation& s, const Alternatives& alternatives) {
  const PointsOnSides points(s);
  std::vector<std::vector<workpiece::VisibleEdge>> visible(s.outline.members.size());
  for (const workpiece::VisibleEdge& e : s.outline.edges)
    visible[static_cast<std::size_t>(e.member)].push_back(e);
  std::vector<Unproven> out;
  for (std::size_t m = 0; m < visible.size(); ++m) {
    add_unproven(s, alternatives, points, s.options.prove_shift_mm, m, visible[m], out);
    // An end that lies deep in another member comes to light only farther off.
    if (s.options.prove_shift_mm < kFarther_mm)
      add_unproven(s, alternatives, points, kFarther_mm, m, visible[m], out);
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const Unproven& a, const Unproven& b) { return a.departure.end && !b.departure.end; });
  return out;
}

std::string place_name(const workpiece::OutlineTemplate& outline, const Departure& departure) {
  const std::string& member = outline.member_names[static_cast<std::size_t>(departure.member)];
  if (departure.over) return fmt::format("way round of {}", member);
  if (departure.side < 0) return fmt::format("direction of {}", member);
  return fmt::format("{} {} of {}", side_word(departure.outward), departure.end ? "end" : "side", member);
}

}  // namespace weldcell::localize
