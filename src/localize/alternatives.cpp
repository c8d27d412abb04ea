#include "alternatives.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include "weldcell/geometry/boxes.hpp"

namespace weldcell::localize {

namespace {

using workpiece::VisibleEdge;

constexpr double kRoom_mm = 10;
/// Members farther apart than this hide nothing of each other.
constexpr double kBeside_mm = 5;
/// An edge shows its ends right within a box when all is known so far around it: joints and the shortest
/// edges reach less far.
constexpr double kBeyond_mm = 12;
/// A crossing is missed once in forty before anything is known of a scan: a beta prior of so many crossings.
/// With a flat one a scan of two members could never say by one crossing that nothing is there.
constexpr double kMissedBefore = 0.5, kSeenBefore = 20;

const Box2 kEverywhere{Vec2::Constant(-1e9), Vec2::Constant(1e9)};

}  // namespace

Alternatives::Alternatives(const workpiece::OutlineTemplate& outline, const std::vector<Crossing>& crossings,
                           std::span<const PathPiece> path, const Fit& fit, const Evidence& evidence)
    : outlines_(outline.members) {
  for (std::size_t m = 0; m < outline.members.size(); ++m) {
    const MemberShift& u = fit.state.members[m];
    const Vec2 about = centroid(outline.members[m]);
    Pose2 turn{0, 0, u.z()};
    const Vec2 t = about - turn.rotate(about) + u.head<2>();
    members_.push_back(transformed(outline.members[m], {t.x(), t.y(), u.z()}));
  }
  for (const Polygon& member : members_) boxes_.push_back(bounds(member));
  const double c = std::cos(fit.state.pose.theta_rad), s = std::sin(fit.state.pose.theta_rad);
  const auto turned = [&](const Vec2& v) { return Vec2(c * v.x() + s * v.y(), -s * v.x() + c * v.y()); };
  spots_.reserve(crossings.size());
  pieces_.reserve(path.size());
  double clutter = 1;
  for (std::size_t i = 0; i < crossings.size(); ++i) {
    const Crossing& seen = crossings[i];
    const Vec2 late = 1e-3 * seen.speed_mm_s * fit.state.latency_ms * turned(seen.direction);
    spots_.push_back({fit.matches[i].place + outline.centroid - late, turned(seen.inward), seen.signed_step,
                      fit.inlier[i] < 0.3});
    clutter += fit.inlier[i] < 0.3;
  }
  double length = 1;
  for (const PathPiece& p : path) {
    const Vec2 a = turned(Vec2(p.x0_mm, p.y0_mm) - fit.state.pose.centre) + outline.centroid;
    const Vec2 b = turned(Vec2(p.x1_mm, p.y1_mm) - fit.state.pose.centre) + outline.centroid;
    pieces_.push_back({a, b});
    length += (b - a).norm();
  }
  std::sort(spots_.begin(), spots_.end(),
            [](const Spot& a, const Spot& b) { return a.place.x() < b.place.x(); });
  for (const MemberEvidence& m : evidence.members) unseen_.push_back(m.expected - m.seen);
  // Density of a point along its travel: on an edge one within twice kOnEdge_mm, clutter of either sign
  // anywhere.
  point_nats_ = std::clamp(std::log(length / (clutter * kOnEdge_mm)), 2.0, 9.0);
  const double missed = std::max(0, evidence.expected - evidence.seen);
  unseen_nats_ = std::clamp(
      -std::log((missed + kMissedBefore) / (evidence.expected + kMissedBefore + kSeenBefore)), 0.3, 5.0);
}

Box2 Alternatives::reach_of(std::size_t member) const { return grown(boxes_[member], kMost_mm + kRoom_mm); }

bool Alternatives::holds_free(const Box2& box) const {
  for (auto s = first_from(box.min.x()); s != spots_.end() && s->place.x() <= box.max.x(); ++s) {
    if (s->free && contains(box, s->place)) return true;
  }
  return false;
}

Alternatives::Region Alternatives::around(std::size_t member) const { return inside(reach_of(member)); }

Alternatives::Region Alternatives::inside(const Box2& box) const {
  Region out;
  out.box = box;
  for (auto s = first_from(box.min.x()); s != spots_.end() && s->place.x() <= box.max.x(); ++s) {
    if (contains(box, s->place)) out.spots.push_back(*s);
  }
  std::copy_if(pieces_.begin(), pieces_.end(), std::back_inserter(out.pieces), [&](const Piece& p) {
    return meets({p.from, p.to}, out.box);
  });
  return out;
}

Alternatives::Region Alternatives::everywhere() const {
  Region out;
  out.box = kEverywhere;
  out.near.resize(members_.size());
  std::iota(out.near.begin(), out.near.end(), std::size_t{0});
  return out;
}

void Alternatives::note_near(std::size_t member, Region& region) const {
  const Box2 reach = grown(region.box, kBeyond_mm);
  for (std::size_t m = 0; m < members_.size(); ++m) {
    if (m == member || (!apart(boxes_[m], reach) && touched(grown(boxes_[m], kBeyond_mm), region)))
      region.near.push_back(m);
  }
}

std::vector<Alternatives::Spot>::const_iterator Alternatives::first_from(double x) const {
  return std::lower_bound(spots_.begin(), spots_.end(), x,
                          [](const Spot& s, double at) { return s.place.x() < at; });
}

std::vector<VisibleEdge> Alternatives::visible(const Variant& part, std::size_t member,
                                               const Region& region) const {
  // Only what lies beside a member hides anything of it; the order of the others stays, since it decides who
  // shows a piece that two share.
  if (outline_of(part, member).empty()) return {};
  const Box2 near = intersection(grown(box_of(part, member), kBeside_mm), grown(region.box, kBeyond_mm));
  std::vector<Polygon> beside;
  std::size_t own = 0;
  for (const std::size_t m : region.near) {
    if (m != member && apart(box_of(part, m), near)) continue;
    const Polygon& outline = outline_of(part, m);
    if (outline.empty()) continue;
    if (m == member) own = beside.size();
    beside.push_back(outline);
  }
  std::vector<VisibleEdge> out = workpiece::visible_edges(beside, own, region.joint_gap_mm);
  for (VisibleEdge& edge : out) edge.member = static_cast<int>(member);
  return out;
}

bool Alternatives::touched(const Box2& box, const Region& region) {
  // Spots may lie a little off an edge, crossings lie on it.
  const Box2 near_spots = grown(box, 2 * kOnEdge_mm), on = intersection(grown(box, kOnEdge_mm), region.box);
  const auto before = [](const Spot& s, double x) { return s.place.x() < x; };
  for (auto s = std::lower_bound(region.spots.begin(), region.spots.end(), near_spots.min.x(), before);
       s != region.spots.end() && s->place.x() <= near_spots.max.x(); ++s) {
    if (contains(near_spots, s->place)) return true;
  }
  return std::any_of(region.pieces.begin(), region.pieces.end(), [&](const Piece& p) {
    return meets({p.from, p.to}, on);
  });
}

std::vector<VisibleEdge> Alternatives::edges_within(const Variant& part, const Region& region) const {
  // Where a member is not as drawn here, what is beside its old or its new place may show other edges.
  std::vector<Box2> changed;
  if (part.outline != nullptr) {
    changed.push_back(grown(boxes_[part.member], kBeside_mm));
    if (!part.outline->empty()) changed.push_back(grown(part.box, kBeside_mm));
  }
  const Box2 reached = grown(region.box, 2 * kOnEdge_mm);
  const auto reaches = [&](const VisibleEdge& e) { return !apart(bounds(e.line), reached); };
  std::vector<VisibleEdge> edges;
  for (const std::size_t m : region.near) {
    const Box2& own = box_of(part, m);
    if (apart(own, region.box) || outline_of(part, m).empty() || !touched(own, region)) continue;
    if (std::any_of(changed.begin(), changed.end(), [&](const Box2& c) { return !apart(own, c); })) {
      const std::vector<VisibleEdge> shown = visible(part, m, region);
      std::copy_if(shown.begin(), shown.end(), std::back_inserter(edges), reaches);
    } else {
      const std::vector<VisibleEdge>& shown = drawn(m, region.joint_gap_mm);
      std::copy_if(shown.begin(), shown.end(), std::back_inserter(edges), reaches);
    }
  }
  return edges;
}

const std::vector<VisibleEdge>& Alternatives::drawn(std::size_t member, double joint_gap_mm) const {
  auto& known = drawn_[joint_gap_mm];
  if (known.empty()) known.resize(members_.size());
  if (!known[member]) {
    Region all = everywhere();
    all.joint_gap_mm = joint_gap_mm;
    known[member] = visible({}, member, all);
  }
  return *known[member];
}

}  // namespace weldcell::localize
