#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <iterator>

#include "outline_sides.hpp"
#include "weldcell/geometry/boxes.hpp"
#include "weldcell/workpiece/departures.hpp"

namespace weldcell::workpiece {

namespace {

constexpr double kEndMargin_mm = 3;
/// Crossings of like direction closer than this are one to a beam that measures steps of many millimetres.
constexpr double kSame_mm = 5;
/// Room that a pass keeps before and behind the edges that tell, and from any other edge at its ends.
constexpr double kRunUp_mm = 20;
constexpr double kClear_mm = 10;
/// Ends are moved outwards in steps until they have that room.
constexpr double kEndStep_mm = 4;
constexpr int kEndSteps = 15;
constexpr int kMustTell = 2;
/// Slots narrower than this hide both sides: members are a little off.
constexpr double kClosed_mm = 2;
/// Places along a side that a pass across it may take.
constexpr int kPlaces = 19;
/// A pass over a member turned over reaches no farther to either side.
constexpr double kWidest_mm = 80;
/// Where the part may lie is tried at so many places each way, and a pass added for no fewer than kWorthIt of
/// them.
constexpr int kTried = 7;
constexpr int kWorthIt = 3;
constexpr std::size_t kMostPasses = 3;

struct Met {
  double at_mm;  ///< along the pass
  Vec2 outward;
};

/// Crossings with the edges, each less its margin at both ends.
std::vector<Met> met_by(const Segment& pass, std::span<const VisibleEdge> edges, double margin_mm) {
  std::vector<Met> out;
  const double length = pass.length();
  for (const VisibleEdge& edge : edges) {
    const double from = (pass.a - edge.line.a).dot(edge.outward),
                 to = (pass.b - edge.line.a).dot(edge.outward);
    if ((from < 0) == (to < 0) || std::abs(to - from) < kMinAcross * length) continue;
    const double share = from / (from - to);
    const double along = (pass.a + share * (pass.b - pass.a) - edge.line.a).dot(edge.line.direction());
    if (along < margin_mm || along > edge.line.length() - margin_mm) continue;
    out.push_back({share * length, edge.outward});
  }
  return out;
}

bool among(const Met& one, const std::vector<Met>& all) {
  return std::any_of(all.begin(), all.end(), [&](const Met& other) {
    return std::abs(other.at_mm - one.at_mm) < kSame_mm && other.outward.dot(one.outward) > 0.5;
  });
}

/// Edges that the members show near the box, one of them with another outline, and in any of the boxes looked
/// at; elsewhere they may lack cuts, or be missing.
std::vector<VisibleEdge> edges_near(std::span<const Polygon> members, std::size_t member,
                                    const Polygon& outline, const Box2& box,
                                    std::span<const Box2> looked_at) {
  std::vector<Polygon> beside;  // in their order, which decides who shows a piece that two share
  for (std::size_t m = 0; m < members.size(); ++m) {
    const Polygon& one = m == member ? outline : members[m];
    if (one.empty()) continue;
    const Box2 own = bounds(one);
    if (!apart(own, box) &&
        std::any_of(looked_at.begin(), looked_at.end(), [&](const Box2& b) { return !apart(own, b); }))
      beside.push_back(one);
  }
  std::vector<VisibleEdge> out;
  for (std::size_t m = 0; m < beside.size(); ++m) {
    for (const VisibleEdge& edge : visible_edges(beside, m, kClosed_mm)) out.push_back(edge);
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
  for (int i = 0; i < kEndSteps && near_edge(pass.a, edges); ++i) pass.a -= kEndStep_mm * d;
  for (int i = 0; i < kEndSteps && near_edge(pass.b, edges); ++i) pass.b += kEndStep_mm * d;
  return pass;
}

/// All that a pass may come near to once its ends are clear.
Box2 neighbourhood(const Segment& pass) {
  Box2 out = bounds(pass);
  constexpr double kRoom_mm = kEndSteps * kEndStep_mm + kClear_mm;
  out.min.array() -= kRoom_mm;
  out.max.array() += kRoom_mm;
  return out;
}

/// The part around a departure, drawn both ways, and the passes that may tell.
struct Views {
  std::vector<VisibleEdge> drawn, instead;
  Box2 near;
  std::vector<Segment> passes;
};

/// Square across side k, from one corner to the other, with so much room to both sides.
std::vector<Segment> passes_across(const Polygon& outline, std::size_t k, double room) {
  const Side side = side_of(outline, k);
  std::vector<Segment> out;
  for (int i = 1; i <= kPlaces; ++i) {
    const Vec2 at = side.a + static_cast<double>(i) / (kPlaces + 1) * side.length * side.d;
    out.push_back({at - room * side.n, at + room * side.n});
  }
  return out;
}

/// Square across the side that moves.
std::vector<Segment> passes_across(const Polygon& outline, const Departure& departure) {
  const auto k = static_cast<std::size_t>(departure.side);
  const Side side = side_of(outline, k), moved = side_of(departure.instead, k);
  // The same both ways, so that one pass settles longer and shorter.
  return passes_across(outline, k, std::abs((moved.a - side.a).dot(side.n)) + kRunUp_mm);
}

/// Across both sides of the end that swings, best first.
std::vector<Segment> passes_near_end(const Polygon& outline, const Departure& departure) {
  const Vec2 along = departure.outward, across(-along.y(), along.x());
  const Extent length = extent(outline, along), width = extent(outline, across);
  std::vector<Segment> out;
  for (const double share : {0.85, 0.75, 0.65, 0.95}) {
    const Vec2 at = (length.low + share * length.size()) * along;
    out.push_back({at + (width.low - kRunUp_mm - kClear_mm) * across,
                   at + (width.high + kRunUp_mm + kClear_mm) * across});
  }
  return out;
}

/// Of passes in order along a side the longest row that tells.
struct Row {
  std::size_t begin = 0, count = 0;
  std::size_t middle() const { return begin + (count - 1) / 2; }
};
Row longest_that_tells(const Views& views) {
  Row best;
  std::size_t row = 0;
  for (std::size_t i = 0; i < views.passes.size(); ++i) {
    row = crossings_that_tell(views.drawn, views.instead, views.passes[i]) >= kMustTell ? row + 1 : 0;
    if (row > best.count) best = {i + 1 - row, row};
  }
  return best;
}

/// Across the side along which a member turned over tells most.
void take_passes_for_turned_over(const Polygon& outline, Views& views) {
  const Vec2 along = longest_direction(outline), across(-along.y(), along.x());
  const double room = std::min(extent(outline, across).size(), kWidest_mm) + kRunUp_mm;
  Row most;
  std::vector<Segment> best;
  for (std::size_t k = 0; k < outline.size(); ++k) {
    views.passes = passes_across(outline, k, room);
    const Row row = longest_that_tells(views);
    if (row.count > most.count) most = row, best = views.passes;
  }
  views.passes = std::move(best);
}

/// Of a part with many members only what the passes come near to is drawn, or else all that is near.
enum class Drawn : std::uint8_t { AtPasses, Near };

Views views_of(std::span<const Polygon> members, const Departure& departure, Drawn extent) {
  const auto m = static_cast<std::size_t>(departure.member);
  Views out;
  out.near = departure.reach;
  out.near.min.array() -= 5 * kRunUp_mm;
  out.near.max.array() += 5 * kRunUp_mm;
  if (departure.side >= 0) {
    out.passes = passes_across(members[m], departure);
  } else if (!departure.over) {
    out.passes = passes_near_end(members[m], departure);
  }
  std::vector<Box2> looked_at{out.near};
  if (extent == Drawn::AtPasses && !departure.over) {
    looked_at.clear();
    std::transform(out.passes.begin(), out.passes.end(), std::back_inserter(looked_at), neighbourhood);
  }
  out.drawn = edges_near(members, m, members[m], out.near, looked_at);
  out.instead = edges_near(members, m, departure.instead, out.near, looked_at);
  if (departure.over) take_passes_for_turned_over(members[m], out);
  return out;
}

std::optional<std::size_t> best_pass(const Views& views, const Departure& departure) {
  // In the middle of where it tells, so that the part may lie a little aside.
  if (departure.side >= 0 || departure.over) {
    const Row row = longest_that_tells(views);
    return row.count > 0 ? std::optional(row.middle()) : std::nullopt;
  }
  for (std::size_t i = 0; i < views.passes.size(); ++i) {
    if (crossings_that_tell(views.drawn, views.instead, views.passes[i]) >= kMustTell) return i;
  }
  return std::nullopt;
}

/// Where the part may lie, a bit for each place that is tried.
using Places = std::uint64_t;
constexpr Places kEverywhere = (Places{1} << (kTried * kTried)) - 1;

/// Where the passes tell, all together.
Places told_by(const Views& views, std::span<const Segment> passes, double off_mm) {
  std::array<int, kTried * kTried> told{};
  for (const Segment& pass : passes) {
    const Box2 own = bounds(pass);
    if ((own.min.array() > views.near.max.array()).any() || (views.near.min.array() > own.max.array()).any())
      continue;
    for (int i = 0; i < kTried * kTried; ++i) {
      const Vec2 by = off_mm * (2.0 / (kTried - 1) * Vec2(i % kTried, i / kTried) - Vec2(1, 1));
      told[static_cast<std::size_t>(i)] +=
          crossings_that_tell(views.drawn, views.instead, {pass.a + by, pass.b + by});
    }
  }
  Places out = 0;
  for (std::size_t i = 0; i < told.size(); ++i) {
    if (told[i] >= kMustTell) out |= Places{1} << i;
  }
  return out;
}

/// The `count` of the masks that tell in most places beside `told`, the first of equal ones.
std::vector<std::size_t> best_together(const std::vector<Places>& masks, Places told, std::size_t count,
                                       std::size_t from = 0) {
  std::vector<std::size_t> best;
  int most = -1;
  for (std::size_t i = from; i < masks.size(); ++i) {
    std::vector<std::size_t> chosen;
    if (count > 1) chosen = best_together(masks, told | masks[i], count - 1, i + 1);
    chosen.push_back(i);
    Places all = told;
    for (const std::size_t k : chosen) all |= masks[k];
    if (chosen.size() < count || std::popcount(all) <= most) continue;
    most = std::popcount(all);
    best = std::move(chosen);
  }
  return best;
}

}  // namespace

int crossings_that_tell(std::span<const VisibleEdge> drawn, std::span<const VisibleEdge> instead,
                        const Segment& pass) {
  // What one has for sure and the other not even near the end of an edge.
  const auto only_in = [&](std::span<const VisibleEdge> one, std::span<const VisibleEdge> other) {
    const std::vector<Met> sure = met_by(pass, one, kEndMargin_mm),
                           maybe = met_by(pass, other, -kEndMargin_mm);
    return static_cast<int>(
        std::count_if(sure.begin(), sure.end(), [&](const Met& m) { return !among(m, maybe); }));
  };
  return only_in(drawn, instead) + only_in(instead, drawn);
}

std::optional<Segment> telling_pass(std::span<const Polygon> members, const Departure& departure) {
  const Views views = views_of(members, departure, Drawn::AtPasses);
  const std::optional<std::size_t> best = best_pass(views, departure);
  if (!best) return std::nullopt;
  return with_clear_ends(views.passes[*best], views.drawn);
}

std::vector<Segment> settling_passes(std::span<const Polygon> members, const Departure& departure,
                                     std::span<const Segment> laid, double off_mm) {
  std::vector<Segment> out;
  const Views views = views_of(members, departure, Drawn::Near);
  const std::optional<std::size_t> best = best_pass(views, departure);
  if (!best) return out;
  const Places told = told_by(views, laid, off_mm);
  if (told == kEverywhere) return out;
  // Nearest to the best one first, which wins where several settle as much.
  std::vector<Segment> passes = views.passes;
  std::stable_sort(passes.begin(), passes.end(), [&](const Segment& a, const Segment& b) {
    return (a.a - views.passes[*best].a).norm() < (b.a - views.passes[*best].a).norm();
  });
  std::vector<Places> masks;
  for (const Segment& pass : passes) {
    masks.push_back(told_by(views, {&pass, 1}, off_mm));
    if ((masks.back() | told) == kEverywhere) break;
  }
  int settled = std::popcount(told);
  for (std::size_t count = 1; count <= kMostPasses && settled < std::popcount(kEverywhere); ++count) {
    Places with = told;
    const std::vector<std::size_t> chosen = best_together(masks, told, count);
    for (const std::size_t k : chosen) with |= masks[k];
    if (std::popcount(with) < settled + kWorthIt) break;
    settled = std::popcount(with);
    out.clear();
    for (const std::size_t k : chosen) out.push_back(with_clear_ends(passes[k], views.drawn));
  }
  return out;
}

}  // namespace weldcell::workpiece
