#include "unshown.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "weldcell/workpiece/departures.hpp"

namespace weldcell::bench {

namespace {

constexpr double kSameStep_mm = 5;  ///< steps of like sense closer than this along the travel are one
constexpr double kApart_mm = 1000;  ///< between passes that do not go on where the one before ended

struct Step {
  double at_mm;  ///< along the whole path: what leaves a short piece is met on the next
  bool up;
};

std::vector<Step> steps_on(std::span<const Segment> path, std::span<const workpiece::VisibleEdge> edges) {
  std::vector<Step> out;
  double begin = 0;
  Vec2 last = path.empty() ? Vec2::Zero() : path.front().a;
  for (const Segment& piece : path) {
    if ((piece.a - last).norm() > kSameStep_mm) begin += kApart_mm;
    for (const workpiece::VisibleEdge& e : edges) {
      const double from = (piece.a - e.line.a).dot(e.outward), to = (piece.b - e.line.a).dot(e.outward);
      if ((from < 0) == (to < 0) || std::abs(to - from) < kGrazing * piece.length()) continue;
      const double share = from / (from - to);
      const double along = (piece.a + share * (piece.b - piece.a) - e.line.a).dot(e.line.direction());
      if (along >= 0 && along <= e.line.length()) out.push_back({begin + share * piece.length(), to < from});
    }
    begin += piece.length();
    last = piece.b;
  }
  return out;
}

bool shows(const std::vector<Step>& one, const std::vector<Step>& other) {
  return std::any_of(one.begin(), one.end(), [&](const Step& s) {
    return std::none_of(other.begin(), other.end(), [&](const Step& o) {
      return o.up == s.up && std::abs(o.at_mm - s.at_mm) < kSameStep_mm;
    });
  });
}

}  // namespace

bool leaves_something_open(const PartUnderTest& part, const EdgeSet& set,
                           const localize::LocalizeOptions& options) {
  const std::vector<Polygon>& drawn = part.outline().members;
  std::vector<Segment> pieces;
  const Pose2 to_part = set.truth.inverse();
  for (const PathPiece& p : set.path)
    pieces.push_back({to_part * Vec2(p.x0_mm, p.y0_mm), to_part * Vec2(p.x1_mm, p.y1_mm)});
  const std::vector<Step> steps = steps_on(pieces, part.outline().edges);
  for (std::size_t m = 0; m < drawn.size(); ++m) {
    for (const workpiece::Departure& d : workpiece::departures(
             drawn, part.outline().edges, m, options.prove_shift_mm, options.prove_free_ends)) {
      if (!workpiece::telling_pass(drawn, d)) continue;
      std::vector<Polygon> other = drawn;
      other[m] = d.instead;
      std::vector<workpiece::VisibleEdge> instead;
      for (std::size_t k = 0; k < other.size(); ++k) {
        for (const workpiece::VisibleEdge& e : workpiece::visible_edges(other, k)) instead.push_back(e);
      }
      const std::vector<Step> other_steps = steps_on(pieces, instead);
      if (!shows(steps, other_steps) && !shows(other_steps, steps)) return true;
    }
  }
  return false;
}

double share_left_open(const PartUnderTest& part, const Setting& setting, int trials, std::uint64_t seed) {
  const localize::LocalizeOptions options = options_for(setting);
  int open = 0;
  for (int i = 0; i < trials; ++i) {
    const EdgeSet set = make_set(part.outline(), setting, seed + static_cast<std::uint64_t>(i));
    open += leaves_something_open(part, set, options);
  }
  return 100.0 * open / trials;
}

}  // namespace weldcell::bench
