#include "weldcell/workpiece/outline_template.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "self_similarity.hpp"
#include "weldcell/geometry/boxes.hpp"

namespace weldcell::workpiece {

namespace {

/// What lies this close beside a side counts as lying on it.
constexpr double kTouch_mm = 1e-3;

double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Parameters in (0, 1) where the line a + t (b - a) meets the polygon's sides.
void append_crossings(const Segment& line, const Polygon& polygon, std::vector<double>& out) {
  const Vec2 d = line.b - line.a;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2& p = polygon[i];
    const Vec2 e = polygon[(i + 1) % polygon.size()] - p;
    const double denominator = cross(d, e);
    if (std::abs(denominator) <= 1e-12 * d.norm() * e.norm()) continue;
    const double t = cross(p - line.a, e) / denominator;
    const double s = cross(p - line.a, d) / denominator;
    if (t > 0 && t < 1 && s > -1e-9 && s < 1 + 1e-9) out.push_back(t);
  }
}

Segment shifted(const Segment& s, const Vec2& by) { return {s.a + by, s.b + by}; }

/// Where a side lies with respect to one other member.
struct Cover {
  const Polygon* polygon = nullptr;
  Box2 box;  ///< what it can hide lies in here
  /// Along the outward normal: the side is hidden where a so shifted point is inside. So many of them count.
  std::array<double, 3> offset_mm{};
  std::size_t count = 0;
  std::span<const double> offsets_mm() const { return {offset_mm.data(), count}; }
};

bool hidden_by(const Cover& cover, const Vec2& p, const Vec2& outward) {
  if ((p.array() < cover.box.min.array()).any() || (p.array() > cover.box.max.array()).any()) return false;
  const std::span<const double> offsets = cover.offsets_mm();
  return std::any_of(offsets.begin(), offsets.end(),
                     [&](double offset) { return contains(*cover.polygon, p + offset * outward); });
}

/// Covers with the stretch of a side that they may hide, as parameters along it, by its start.
struct Stretch {
  double from, to;
  const Cover* cover;
};
std::vector<Stretch> stretches(const Segment& side, const std::vector<Cover>& covers) {
  constexpr double kSlack = 1e-9;
  const Box2 own = bounds(side);
  const Vec2 d = side.b - side.a;
  std::vector<Stretch> out;
  out.reserve(covers.size());
  for (const Cover& cover : covers) {
    if (apart(own, cover.box)) continue;
    const Vec2 half = (cover.box.max - cover.box.min) / 2;
    const double middle = (cover.box.min + half - side.a).dot(d) / d.squaredNorm();
    const double reach = half.dot(d.cwiseAbs()) / d.squaredNorm() + kSlack;
    out.push_back({middle - reach, middle + reach, &cover});
  }
  std::sort(out.begin(), out.end(), [](const Stretch& a, const Stretch& b) { return a.from < b.from; });
  return out;
}

/// The visible intervals of a side, as parameters along it.
std::vector<std::pair<double, double>> visible_intervals(const Segment& side, const Vec2& outward,
                                                         const std::vector<Cover>& covers) {
  const std::vector<Stretch> near = stretches(side, covers);
  std::vector<double> cuts{0, 1};
  for (const Stretch& stretch : near) {
    for (const double offset : stretch.cover->offsets_mm())
      append_crossings(shifted(side, offset * outward), *stretch.cover->polygon, cuts);
  }
  std::sort(cuts.begin(), cuts.end());
  std::vector<std::pair<double, double>> out;
  auto first = near.begin();  // those before it end before the interval
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    const double from = cuts[i], to = cuts[i + 1], at = (from + to) / 2;
    if (to - from <= 1e-9) continue;
    while (first != near.end() && first->to < at) ++first;
    const Vec2 place = side.a + at * (side.b - side.a);
    bool hidden = false;
    for (auto s = first; s != near.end() && s->from <= at && !hidden; ++s)
      hidden = hidden_by(*s->cover, place, outward);
    if (hidden) continue;
    if (!out.empty() && from - out.back().second <= 1e-9) {
      out.back().second = to;
    } else {
      out.emplace_back(from, to);
    }
  }
  return out;
}

/// Of two members that share a piece of silhouette only the first one shows it.
std::vector<Cover> covers_of(std::span<const Polygon> members, std::size_t member, double joint_gap_mm) {
  std::vector<Cover> covers;
  covers.reserve(members.size());
  const Box2 own = bounds(members[member]);
  for (std::size_t j = 0; j < members.size(); ++j) {
    if (j == member || members[j].empty()) continue;
    const Box2 reach = grown(bounds(members[j]), 2 * joint_gap_mm + kTouch_mm);
    if (apart(own, reach)) continue;
    covers.push_back({&members[j], reach, {joint_gap_mm, kTouch_mm, -kTouch_mm}, j < member ? 3U : 2U});
  }
  return covers;
}

double longest_side(const Polygon& polygon) {
  double longest = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    longest = std::max(longest, (polygon[(i + 1) % polygon.size()] - polygon[i]).norm());
  }
  return longest;
}

}  // namespace

std::vector<VisibleEdge> visible_edges(std::span<const Polygon> members, std::size_t member,
                                       double joint_gap_mm) {
  std::vector<VisibleEdge> out;
  const Polygon& outline = members[member];
  if (outline.empty()) return out;
  out.reserve(outline.size());
  const std::vector<Cover> covers = covers_of(members, member, joint_gap_mm);
  // A mitre's tip stays uncovered over about one joint gap; it is no edge that a laser could see.
  const double shortest = std::max(1.0, 2 * joint_gap_mm);
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Segment side{outline[i], outline[(i + 1) % outline.size()]};
    const Vec2 d = side.direction();
    VisibleEdge edge;
    edge.outward = {d.y(), -d.x()};
    edge.member = static_cast<int>(member);
    edge.side = static_cast<int>(i);
    for (const auto& [from, to] : visible_intervals(side, edge.outward, covers)) {
      edge.line = {side.a + from * (side.b - side.a), side.a + to * (side.b - side.a)};
      if (edge.line.length() >= shortest) out.push_back(edge);
    }
  }
  return out;
}

Result<OutlineTemplate> build_template(const Workpiece& workpiece, double joint_gap_mm) {
  OutlineTemplate out;
  out.name = workpiece.name;
  out.height_mm = workpiece.height_mm;
  for (std::size_t i = 0; i < workpiece.members.size(); ++i) {
    out.member_names.push_back(workpiece.members[i].name);
    out.members.push_back(workpiece.members[i].outline);
  }
  for (std::size_t i = 0; i < workpiece.members.size(); ++i) {
    const double long_side = longest_side(out.members[i]) / 2;
    for (VisibleEdge& edge : visible_edges(out.members, i, joint_gap_mm)) {
      const Polygon& outline = out.members[i];
      const auto side = static_cast<std::size_t>(edge.side);
      edge.round = workpiece.members[i].edge_radius_mm > 0 &&
                   (outline[(side + 1) % outline.size()] - outline[side]).norm() >= long_side;
      if (edge.round) edge.radius_mm = std::min(workpiece.members[i].edge_radius_mm, workpiece.height_mm);
      out.edges.push_back(edge);
    }
  }
  if (out.edges.empty()) {
    return Error{"template.empty", workpiece.name, "no side of any member can be seen from above",
                 "check the outlines: do they cover each other?"};
  }
  double length = 0;
  Vec2 moment = Vec2::Zero();
  for (const VisibleEdge& edge : out.edges) {
    length += edge.line.length();
    moment += edge.line.length() * (edge.line.a + edge.line.b) / 2;
  }
  out.centroid = moment / length;
  for (const VisibleEdge& edge : out.edges) {
    out.radius_mm =
        std::max({out.radius_mm, (edge.line.a - out.centroid).norm(), (edge.line.b - out.centroid).norm()});
  }
  out.symmetries = find_symmetries(out);
  return out;
}

}  // namespace weldcell::workpiece
