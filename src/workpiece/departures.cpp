#include "weldcell/workpiece/departures.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace weldcell::workpiece {

namespace {

constexpr double kShortestSide_mm = 8;
constexpr double kMinAcross = 0.35;
constexpr double kEndMargin_mm = 3;
/// Crossings of like direction closer than this are one to a beam that measures steps of many millimetres.
constexpr double kSame_mm = 5;
/// Room that a pass keeps before and behind the edges that tell, and from any other edge at its ends.
constexpr double kRunUp_mm = 20;
constexpr double kClear_mm = 10;
/// Members this much longer than wide have a direction.
constexpr double kSlender = 2;
constexpr int kMustTell = 2;

struct Side {
  Vec2 a, b, d, n;
  double length;
};

Side side_of(const Polygon& outline, std::size_t k) {
  const Segment s{outline[k % outline.size()], outline[(k + 1) % outline.size()]};
  const Vec2 d = s.direction();
  return {s.a, s.b, d, {d.y(), -d.x()}, s.length()};
}

Vec2 longest_direction(const Polygon& outline) {
  Side best = side_of(outline, 0);
  for (std::size_t k = 1; k < outline.size(); ++k) {
    const Side s = side_of(outline, k);
    if (s.length > best.length * (1 + 1e-9)) best = s;
  }
  return best.d;
}

/// The side moved along its normal; its neighbours keep their lines where they stand steeply enough on it.
Polygon with_side_moved(const Polygon& outline, std::size_t k, double by_mm) {
  const Side side = side_of(outline, k);
  const auto slid = [&](const Vec2& vertex, const Vec2& along) -> Vec2 {
    const double steep = along.dot(side.n);
    return vertex + (std::abs(steep) < 0.3 ? Vec2(by_mm * side.n) : Vec2(by_mm / steep * along));
  };
  Polygon out = outline;
  out[k] = slid(side.a, side_of(outline, k + outline.size() - 1).d);
  out[(k + 1) % outline.size()] = slid(side.b, side_of(outline, k + 1).d);
  return out;
}

Box2 both(const Box2& a, const Box2& b) { return {a.min.cwiseMin(b.min), a.max.cwiseMax(b.max)}; }

Polygon shifted(const Polygon& outline, const Vec2& by) {
  Polygon out = outline;
  for (Vec2& p : out) p += by;
  return out;
}

struct Extent {
  double low, high;
  double size() const { return high - low; }
};

Extent extent(const Polygon& outline, const Vec2& axis) {
  Extent out{axis.dot(outline.front()), axis.dot(outline.front())};
  for (const Vec2& p : outline) {
    out.low = std::min(out.low, axis.dot(p));
    out.high = std::max(out.high, axis.dot(p));
  }
  return out;
}

void add_turns(const Polygon& outline, std::size_t member, double by_mm, std::vector<Departure>& out) {
  const Vec2 along = longest_direction(outline), across(-along.y(), along.x());
  const Extent length = extent(outline, along), width = extent(outline, across);
  if (length.size() < kSlender * width.size()) return;
  const double middle = (width.low + width.high) / 2;
  for (const bool far_end : {false, true}) {
    const Vec2 pivot = (far_end ? length.low : length.high) * along + middle * across;
    for (const double angle : {by_mm / length.size(), -by_mm / length.size()}) {
      Departure turn;
      turn.member = static_cast<int>(member);
      turn.outward = far_end ? along : Vec2(-along);
      const Pose2 rotation{0, 0, angle};
      for (const Vec2& p : outline) turn.instead.push_back(pivot + rotation.rotate(p - pivot));
      turn.reach = both(bounds(outline), bounds(turn.instead));
      out.push_back(std::move(turn));
    }
  }
}

struct Met {
  double at_mm;  ///< along the pass
  Vec2 outward;
};

std::vector<Met> met_by(const Segment& pass, std::span<const VisibleEdge> edges) {
  std::vector<Met> out;
  const double length = pass.length();
  for (const VisibleEdge& edge : edges) {
    const double from = (pass.a - edge.line.a).dot(edge.outward),
                 to = (pass.b - edge.line.a).dot(edge.outward);
    if ((from < 0) == (to < 0) || std::abs(to - from) < kMinAcross * length) continue;
    const double share = from / (from - to);
    const double along = (pass.a + share * (pass.b - pass.a) - edge.line.a).dot(edge.line.direction());
    if (along < kEndMargin_mm || along > edge.line.length() - kEndMargin_mm) continue;
    out.push_back({share * length, edge.outward});
  }
  return out;
}

bool among(const Met& one, const std::vector<Met>& all) {
  return std::any_of(all.begin(), all.end(), [&](const Met& other) {
    return std::abs(other.at_mm - one.at_mm) < kSame_mm && other.outward.dot(one.outward) > 0.5;
  });
}

/// Edges of all members near the box, one of them as given.
std::vector<VisibleEdge> edges_near(std::span<const Polygon> members, const Box2& box) {
  std::vector<VisibleEdge> out;
  for (std::size_t m = 0; m < members.size(); ++m) {
    if (members[m].empty()) continue;
    const Box2 own = bounds(members[m]);
    if ((own.min.array() > box.max.array()).any() || (box.min.array() > own.max.array()).any()) continue;
    for (const VisibleEdge& edge : visible_edges(members, m)) out.push_back(edge);
  }
  return out;
}

/// Whether the place lies within reach of an edge that the pass crosses.
bool near_edge(const Vec2& place, std::span<const VisibleEdge> edges) {
  return std::any_of(edges.begin(), edges.end(),
                     [&](const VisibleEdge& e) { return distance(place, e.line) < kClear_mm; });
}

/// Ends moved outwards until no edge is within kClear_mm of them.
Segment with_clear_ends(Segment pass, std::span<const VisibleEdge> edges) {
  const Vec2 d = pass.direction();
  constexpr int kSteps = 15;
  for (int i = 0; i < kSteps && near_edge(pass.a, edges); ++i) pass.a -= 4 * d;
  for (int i = 0; i < kSteps && near_edge(pass.b, edges); ++i) pass.b += 4 * d;
  return pass;
}

}  // namespace

bool is_end(const Polygon& outline, std::size_t side) {
  return std::abs(side_of(outline, side).d.dot(longest_direction(outline))) < 0.8;
}

std::vector<Departure> departures(std::span<const Polygon> members, std::span<const VisibleEdge> visible,
                                  std::size_t member, double by_mm, bool free_ends) {
  std::vector<Departure> out;
  const Polygon& outline = members[member];
  if (outline.size() < 3) return out;
  std::vector<double> shown(outline.size(), 0);
  for (const VisibleEdge& e : visible) {
    if (e.member == static_cast<int>(member)) shown[static_cast<std::size_t>(e.side)] += e.line.length();
  }
  for (std::size_t k = 0; k < outline.size(); ++k) {
    const Side side = side_of(outline, k);
    if (side.length < kShortestSide_mm) continue;
    for (const double by : {by_mm, -by_mm}) {
      const bool open = shown[k] >= 0.5 * side.length;
      if (by > 0 && !open) continue;
      Departure move;
      move.member = static_cast<int>(member);
      move.side = static_cast<int>(k);
      move.end = is_end(outline, k);
      move.outward = side.n;
      move.whole = open && move.end && !free_ends;
      if (move.whole && by > 0) continue;  // a shift that way moves away from the other end
      move.instead = move.whole ? shifted(outline, by * side.n) : with_side_moved(outline, k, by);
      if (std::abs(signed_area(move.instead)) < 0.5 * std::abs(signed_area(outline))) continue;
      move.reach = move.whole
                       ? both(bounds(outline), bounds(move.instead))
                       : bounds({side.a, side.b, move.instead[k], move.instead[(k + 1) % outline.size()]});
      out.push_back(std::move(move));
    }
  }
  add_turns(outline, member, by_mm, out);
  return out;
}

int crossings_that_tell(std::span<const VisibleEdge> drawn, std::span<const VisibleEdge> instead,
                        const Segment& pass) {
  const std::vector<Met> here = met_by(pass, drawn), there = met_by(pass, instead);
  const auto only_in = [](const std::vector<Met>& a, const std::vector<Met>& b) {
    return static_cast<int>(std::count_if(a.begin(), a.end(), [&](const Met& m) { return !among(m, b); }));
  };
  return only_in(here, there) + only_in(there, here);
}

std::optional<Segment> telling_pass(std::span<const Polygon> members, const Departure& departure) {
  const auto m = static_cast<std::size_t>(departure.member);
  Box2 near = departure.reach;
  near.min.array() -= 5 * kRunUp_mm;
  near.max.array() += 5 * kRunUp_mm;
  std::vector<Polygon> other(members.begin(), members.end());
  const std::vector<VisibleEdge> drawn = edges_near(other, near);
  other[m] = departure.instead;
  const std::vector<VisibleEdge> instead = edges_near(other, near);

  const Polygon& outline = members[m];
  std::vector<Segment> passes;
  if (departure.side >= 0) {
    const auto k = static_cast<std::size_t>(departure.side);
    const Side side = side_of(outline, k), moved = side_of(departure.instead, k);
    // The same both ways, so that one pass settles longer and shorter.
    const double room = std::abs((moved.a - side.a).dot(side.n)) + kRunUp_mm;
    for (const double share : {0.5, 0.35, 0.65, 0.2, 0.8, 0.1, 0.9}) {
      const Vec2 at = side.a + share * side.length * side.d;
      passes.push_back({at - room * side.n, at + room * side.n});
    }
  } else {
    const Vec2 along = departure.outward, across(-along.y(), along.x());
    const Extent length = extent(outline, along), width = extent(outline, across);
    for (const double share : {0.85, 0.75, 0.65, 0.95}) {
      const Vec2 at = (length.low + share * length.size()) * along;
      passes.push_back({at + (width.low - kRunUp_mm - kClear_mm) * across,
                        at + (width.high + kRunUp_mm + kClear_mm) * across});
    }
  }
  for (const Segment& pass : passes) {
    if (crossings_that_tell(drawn, instead, pass) >= kMustTell) return with_clear_ends(pass, drawn);
  }
  return std::nullopt;
}

}  // namespace weldcell::workpiece
