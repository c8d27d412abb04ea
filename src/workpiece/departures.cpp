#include "weldcell/workpiece/departures.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "outline_sides.hpp"
#include "weldcell/geometry/boxes.hpp"

namespace weldcell::workpiece {

namespace {

constexpr double kShortestSide_mm = 8;
/// Members this much longer than wide have a direction.
constexpr double kSlender = 2;
/// Outlines whose corners lie closer than this are one.
constexpr double kSameOutline_mm = 5;

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

void add_turns(const Polygon& outline, std::size_t member, double by_mm, std::vector<Departure>& out) {
  const Vec2 along = longest_direction(outline), across(-along.y(), along.x());
  const Extent length = extent(outline, along), width = extent(outline, across);
  if (length.size() < kSlender * width.size()) return;
  const double middle = width.middle();
  for (const bool far_end : {false, true}) {
    const Vec2 pivot = (far_end ? length.low : length.high) * along + middle * across;
    for (const double angle : {by_mm / length.size(), -by_mm / length.size()}) {
      Departure turn;
      turn.member = static_cast<int>(member);
      turn.outward = far_end ? along : Vec2(-along);
      const Pose2 rotation{0, 0, angle};
      for (const Vec2& p : outline) turn.instead.push_back(pivot + rotation.rotate(p - pivot));
      turn.reach = united(bounds(outline), bounds(turn.instead));
      out.push_back(std::move(turn));
    }
  }
}

bool same_outline(const Polygon& a, const Polygon& b) {
  return std::all_of(a.begin(), a.end(), [&](const Vec2& p) {
    return std::any_of(b.begin(), b.end(), [&](const Vec2& q) { return (p - q).norm() < kSameOutline_mm; });
  });
}

}  // namespace

bool is_end(const Polygon& outline, std::size_t side) {
  return std::abs(side_of(outline, side).d.dot(longest_direction(outline))) < 0.8;
}

std::vector<Departure> turned_over(std::span<const Polygon> members, std::size_t member) {
  std::vector<Departure> out;
  const Polygon& outline = members[member];
  if (outline.size() < 3) return out;
  const Vec2 along = longest_direction(outline), across(-along.y(), along.x());
  const double length = 2 * extent(outline, along).middle(), width = 2 * extent(outline, across).middle();
  for (const auto& [over, round] : {std::pair{true, false}, std::pair{false, true}, std::pair{true, true}}) {
    Departure other;
    other.member = static_cast<int>(member);
    other.over = true;
    for (const Vec2& p : outline) {
      const double x = p.dot(along), y = p.dot(across);
      other.instead.push_back((round ? length - x : x) * along + (over ? width - y : y) * across);
    }
    if (over != round) std::reverse(other.instead.begin(), other.instead.end());
    if (same_outline(other.instead, outline) || std::any_of(out.begin(), out.end(), [&](const Departure& d) {
          return same_outline(other.instead, d.instead);
        }))
      continue;
    other.reach = united(bounds(outline), bounds(other.instead));
    out.push_back(std::move(other));
  }
  return out;
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
                       ? united(bounds(outline), bounds(move.instead))
                       : bounds({side.a, side.b, move.instead[k], move.instead[(k + 1) % outline.size()]});
      out.push_back(std::move(move));
    }
  }
  add_turns(outline, member, by_mm, out);
  std::vector<Departure> over = turned_over(members, member);
  std::move(over.begin(), over.end(), std::back_inserter(out));
  return out;
}

std::vector<Departure> shifts(std::span<const Polygon> members, std::size_t member, const Vec2& by_mm) {
  std::vector<Departure> out;
  const Polygon& outline = members[member];
  const auto moves = [&](const Departure& d) { return std::abs(d.outward.dot(by_mm)); };
  for (std::size_t k = 0; k < outline.size(); ++k) {
    Departure move;
    move.member = static_cast<int>(member);
    move.side = static_cast<int>(k);
    move.whole = true;
    move.end = is_end(outline, k);
    move.outward = side_of(outline, k).n;
    move.instead = shifted(outline, by_mm);
    move.reach = united(bounds(outline), bounds(move.instead));
    if (moves(move) > kMinAcross * by_mm.norm()) out.push_back(std::move(move));
  }
  std::stable_sort(out.begin(), out.end(),
                   [&](const Departure& a, const Departure& b) { return moves(a) > moves(b); });
  return out;
}

}  // namespace weldcell::workpiece
