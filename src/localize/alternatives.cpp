#include "alternatives.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

namespace weldcell::localize {

namespace {

using workpiece::VisibleEdge;

/// A point this close to an edge lies on it: noise, and members that are a little off.
constexpr double kOnEdge_mm = 1.5;
/// A crossing is seen when a point of its sign lies this close to it.
constexpr double kSeenAt_mm = 5;
constexpr double kMinAcross = 0.35;
/// A joint of members that are a little off is closed to the beam all the same.
constexpr double kClosed_mm = 2;
/// A joint that stands open by less may hide its sides, from where the receiver looks across it.
constexpr double kNarrow_mm = 6;
/// Beam and noise decide nearer to the end of an edge.
constexpr double kLeastEndMargin_mm = 1.5;
/// A side tells nothing about a step against it, nor along it.
constexpr double kAgainst = -0.15;
constexpr double kRoom_mm = 10;
/// Members farther apart than this hide nothing of each other.
constexpr double kBeside_mm = 5;
/// An edge shows its ends right within a box when all is known so far around it: joints and the shortest
/// edges reach less far.
constexpr double kBeyond_mm = 12;
/// A crossing is missed once in forty before anything is known of a scan: a beta prior of so many crossings.
/// With a flat one a scan of two members could never say by one crossing that nothing is there.
constexpr double kMissedBefore = 0.5, kSeenBefore = 20;
/// Below this nothing is worth a closer look.
constexpr double kHopeless_nats = 3;

bool in_box(const Vec2& p, const Box2& box) {
  return (p.array() >= box.min.array()).all() && (p.array() <= box.max.array()).all();
}

bool apart(const Box2& a, const Box2& b) {
  return (a.min.array() > b.max.array()).any() || (b.min.array() > a.max.array()).any();
}

/// Whether any of a segment lies in a box.
bool meets(const Segment& s, const Box2& box) {
  if (apart({s.a.cwiseMin(s.b), s.a.cwiseMax(s.b)}, box)) return false;
  const Vec2 d = s.b - s.a, half = (box.max - box.min) / 2, from = box.min + half - s.a;
  const double reach = half.x() * std::abs(d.y()) + half.y() * std::abs(d.x());
  return std::abs(d.x() * from.y() - d.y() * from.x()) <= reach + 1e-9 * d.squaredNorm();
}

Box2 grown(const Box2& box, double by) { return {Vec2(box.min.array() - by), Vec2(box.max.array() + by)}; }

Box2 common(const Box2& a, const Box2& b) { return {a.min.cwiseMax(b.min), a.max.cwiseMin(b.max)}; }

const Box2 kEverywhere{Vec2::Constant(-1e9), Vec2::Constant(1e9)};

Polygon shifted(const Polygon& polygon, const Vec2& by) {
  Polygon out = polygon;
  for (Vec2& p : out) p += by;
  return out;
}

/// Normals and directions of the sides, each line once.
std::vector<Vec2> axes_of(const Polygon& outline) {
  std::vector<Vec2> out;
  for (std::size_t k = 0; k < outline.size(); ++k) {
    const Vec2 d = Segment{outline[k], outline[(k + 1) % outline.size()]}.direction();
    for (const Vec2& axis : {d, Vec2(d.y(), -d.x())}) {
      if (std::none_of(out.begin(), out.end(), [&](const Vec2& a) { return std::abs(a.dot(axis)) > 0.999; }))
        out.push_back(axis);
    }
  }
  return out;
}

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
    if (s->free && in_box(s->place, box)) return true;
  }
  return false;
}

Alternatives::Region Alternatives::around(std::size_t member) const { return inside(reach_of(member)); }

Alternatives::Region Alternatives::inside(const Box2& box) const {
  Region out;
  out.box = box;
  for (auto s = first_from(box.min.x()); s != spots_.end() && s->place.x() <= box.max.x(); ++s) {
    if (in_box(s->place, box)) out.spots.push_back(*s);
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

int Alternatives::unseen_on(const std::vector<VisibleEdge>& edges, const Region& region) const {
  int out = 0;
  const auto before = [](const Spot& s, double x) { return s.place.x() < x; };
  for (const VisibleEdge& edge : edges) {
    const Vec2 d = edge.line.direction();
    const double length = edge.line.length();
    for (const Piece& piece : region.pieces) {
      const Vec2 a = piece.from - edge.line.a, b = piece.to - edge.line.a;
      const double from = a.dot(edge.outward), to = b.dot(edge.outward);
      if ((from < 0) == (to < 0) || std::abs(to - from) < kMinAcross * (b - a).norm()) continue;
      const Vec2 at = a + from / (from - to) * (b - a);
      const double along = at.dot(d);
      if (along < region.end_margin_mm || along > length - region.end_margin_mm) continue;
      const Vec2 place = edge.line.a + at;
      if (!in_box(place, region.box)) continue;
      bool seen = false;
      auto s = std::lower_bound(region.spots.begin(), region.spots.end(), place.x() - kSeenAt_mm, before);
      for (; s != region.spots.end() && s->place.x() <= place.x() + kSeenAt_mm && !seen; ++s) {
        seen = (s->place - place).squaredNorm() < kSeenAt_mm * kSeenAt_mm &&
               (!s->directed || s->inward.dot(edge.outward) < kAgainst);
      }
      out += !seen;
    }
  }
  return out;
}

std::vector<VisibleEdge> Alternatives::visible(const Variant& part, std::size_t member,
                                               const Region& region) const {
  // Only what lies beside a member hides anything of it; the order of the others stays, since it decides who
  // shows a piece that two share.
  if (outline_of(part, member).empty()) return {};
  const Box2 near = common(grown(box_of(part, member), kBeside_mm), grown(region.box, kBeyond_mm));
  std::vector<const Polygon*> beside;
  std::size_t own = 0;
  for (const std::size_t m : region.near) {
    if (m != member && apart(box_of(part, m), near)) continue;
    const Polygon& outline = outline_of(part, m);
    if (outline.empty()) continue;
    if (m == member) own = beside.size();
    beside.push_back(&outline);
  }
  std::vector<VisibleEdge> out = workpiece::visible_edges(beside, own, region.joint_gap_mm);
  for (VisibleEdge& edge : out) edge.member = static_cast<int>(member);
  return out;
}

bool Alternatives::touched(const Box2& box, const Region& region) {
  // Spots may lie a little off an edge, crossings lie on it.
  const Box2 near_spots = grown(box, 2 * kOnEdge_mm), on = common(grown(box, kOnEdge_mm), region.box);
  const auto before = [](const Spot& s, double x) { return s.place.x() < x; };
  for (auto s = std::lower_bound(region.spots.begin(), region.spots.end(), near_spots.min.x(), before);
       s != region.spots.end() && s->place.x() <= near_spots.max.x(); ++s) {
    if (in_box(s->place, near_spots)) return true;
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
  const auto reaches = [&](const VisibleEdge& e) {
    return !apart({e.line.a.cwiseMin(e.line.b), e.line.a.cwiseMax(e.line.b)}, reached);
  };
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

double Alternatives::explained_nats(const std::vector<VisibleEdge>& edges, const Region& region) const {
  std::vector<bool> explained(region.spots.size(), false);
  const auto before = [](const Spot& s, double x) { return s.place.x() < x; };
  for (const VisibleEdge& e : edges) {
    const Vec2 d = e.line.direction();
    const double length = e.line.length(), reach = 2 * kOnEdge_mm;
    const double last = std::max(e.line.a.x(), e.line.b.x()) + reach;
    auto s = std::lower_bound(region.spots.begin(), region.spots.end(),
                              std::min(e.line.a.x(), e.line.b.x()) - reach, before);
    for (; s != region.spots.end() && s->place.x() <= last; ++s) {
      const Vec2 from = s->place - e.line.a;
      if (std::abs(from.dot(e.outward)) > kOnEdge_mm) continue;
      if (s->directed && s->inward.dot(e.outward) >= kAgainst) continue;
      const double along = from.dot(d);
      if (along < -kOnEdge_mm || along > length + kOnEdge_mm) continue;
      explained[static_cast<std::size_t>(s - region.spots.begin())] = true;
    }
  }
  return point_nats_ * static_cast<double>(std::count(explained.begin(), explained.end(), true));
}

double Alternatives::score(const Variant& part, const Region& region) const {
  const std::vector<VisibleEdge> edges = edges_within(part, region);
  return explained_nats(edges, region) - unseen_nats_ * unseen_on(edges, region);
}

double Alternatives::slots_nats(const Variant& part, Region region) const {
  const auto hidden_in = [&](const Variant& variant) {
    const auto unseen = [&](double joint_gap_mm) {
      region.joint_gap_mm = joint_gap_mm;
      return unseen_on(edges_within(variant, region), region);
    };
    return unseen(kJointGap_mm) - unseen(kNarrow_mm);
  };
  const int drawn = hidden_in({});
  return drawn > 0 ? unseen_nats_ * std::max(0, drawn - hidden_in(part)) : 0;
}

double Alternatives::whole() const {
  Region all = everywhere();
  all.spots = spots_;
  return explained_nats(edges_within({}, all), all);
}

bool Alternatives::refutes(std::size_t member, const Polygon& instead, const Box2& within,
                           double nats) const {
  Region region = inside(grown(within, kSeenAt_mm));
  note_near(member, region);
  region.end_margin_mm = kLeastEndMargin_mm;
  const Variant drawn, other{member, &instead, bounds(instead)};
  // A point may lie on a side that a narrow slot shows; nobody has to have seen one there.
  const auto unseen = [&](const Variant& part, double joint_gap_mm) {
    region.joint_gap_mm = joint_gap_mm;
    return unseen_on(edges_within(part, region), region);
  };
  const double explained = explained_nats(edges_within(other, region), region) -
                           explained_nats(edges_within(drawn, region), region);
  // Crossings that no narrow slot can have hidden; slots that the drawing has as well hide as much in both.
  const int surely = unseen(drawn, kNarrow_mm);
  const auto refuted_by = [&](int unseen_there) {
    return explained - unseen_nats_ * (unseen_there - surely) <= -nats;
  };
  if (refuted_by(0)) return true;
  const int hidden = unseen(drawn, kClosed_mm) - surely;
  const int closed = unseen(other, kClosed_mm);
  return refuted_by(closed - hidden) || refuted_by(unseen(other, kNarrow_mm));
}

double Alternatives::most_gain(const Box2& within) const {
  const Box2 box = grown(within, kSeenAt_mm);
  int free = 0;
  for (auto s = first_from(box.min.x()); s != spots_.end() && s->place.x() <= box.max.x(); ++s)
    free += s->free && in_box(s->place, box);
  return point_nats_ * free + unseen_nats_ * std::accumulate(unseen_.begin(), unseen_.end(), 0);
}

double Alternatives::places_nats() const {
  double out = 1;
  for (const Polygon& outline : outlines_)
    out += static_cast<double>(axes_of(outline).size()) * 2 * (kMost_mm - kLeast_mm) / (2 * kOnEdge_mm);
  return std::log(out);
}

double Alternatives::missing(int member) const {
  const auto m = static_cast<std::size_t>(member);
  Region region = around(m);
  note_near(m, region);
  const Polygon nothing;
  return score({m, &nothing, boxes_[m]}, region) - score({}, region);
}

std::vector<Alternatives::Vote> Alternatives::votes(const Polygon& outline, const Region& region,
                                                    bool loosely) const {
  struct Step {
    double by_mm;
    std::size_t axis;
  };
  const Box2 box = grown(bounds(outline), kMost_mm + kOnEdge_mm);
  const std::vector<Vec2> axes = axes_of(outline);
  const double slack = loosely ? kMost_mm : kOnEdge_mm;
  std::vector<Step> offsets;
  for (const Spot& s : region.spots) {
    if (!s.free || !in_box(s.place, box)) continue;
    for (std::size_t k = 0; k < outline.size(); ++k) {
      const Segment side{outline[k], outline[(k + 1) % outline.size()]};
      const Vec2 d = side.direction(), n(d.y(), -d.x());
      if (s.directed && s.inward.dot(n) >= kAgainst) continue;
      for (std::size_t e = 0; e < axes.size(); ++e) {
        if (std::abs(axes[e].dot(n)) < kMinAcross) continue;
        const double by = (s.place - side.a).dot(n) / axes[e].dot(n);
        const double along = (s.place - side.a - by * axes[e]).dot(d);
        if (std::abs(by) > kMost_mm || along < -slack || along > side.length() + slack) continue;
        offsets.push_back({by, e});
      }
    }
  }
  std::vector<Vote> out;
  for (const Step& o : offsets) {
    if (std::abs(o.by_mm) < kLeast_mm) continue;
    Vote vote{axes[o.axis], 0, 0};
    for (const Step& other : offsets) {
      if (other.axis != o.axis || std::abs(other.by_mm - o.by_mm) > kOnEdge_mm) continue;
      vote.by_mm += other.by_mm;
      ++vote.points;
    }
    vote.by_mm /= vote.points;
    out.push_back(vote);
  }
  std::stable_sort(out.begin(), out.end(), [](const Vote& a, const Vote& b) { return a.points > b.points; });
  std::vector<Vote> distinct;
  for (const Vote& v : out) {
    if (std::none_of(distinct.begin(), distinct.end(), [&](const Vote& w) {
          return w.axis == v.axis && std::abs(w.by_mm - v.by_mm) < kOnEdge_mm;
        })) {
      distinct.push_back(v);
    }
  }
  return distinct;
}

/// Unexplained points on sides of others that this member should cover.
int Alternatives::bared_by(std::size_t member, const Region& region) const {
  const Polygon& own = members_[member];
  const Box2 box = grown(boxes_[member], kOnEdge_mm);
  int out = 0;
  for (const Spot& s : region.spots) {
    if (!s.free || !in_box(s.place, box)) continue;
    bool on_hidden_side = false;
    for (std::size_t m = 0; m < members_.size() && !on_hidden_side; ++m) {
      const Polygon& other = members_[m];
      if (m == member || !in_box(s.place, grown(boxes_[m], kOnEdge_mm))) continue;
      for (std::size_t k = 0; k < other.size() && !on_hidden_side; ++k) {
        const Segment side{other[k], other[(k + 1) % other.size()]};
        const Vec2 d = side.direction(), n(d.y(), -d.x());
        on_hidden_side = distance(s.place, side) <= kOnEdge_mm &&
                         (!s.directed || s.inward.dot(n) < kAgainst) &&
                         (contains(own, s.place + kOnEdge_mm * n) || contains(own, s.place));
      }
    }
    out += on_hidden_side;
  }
  return out;
}

Displacement Alternatives::displaced(int member, bool anywhere) const {
  const auto m = static_cast<std::size_t>(member);
  Displacement best;
  best.member = member;
  if (members_[m].empty()) return best;
  if (unseen_[m] == 0 && !holds_free(reach_of(m))) return best;
  Region region = around(m);
  note_near(m, region);
  displaced_from(members_[m], anywhere, region, best);
  // A fit that followed a displaced member half the way has turned it as well.
  if (anywhere) displaced_from(outlines_[m], anywhere, region, best);
  return best;
}

/// Weighs the displacements of an outline that points vote for, and puts a better one in the place of best.
void Alternatives::displaced_from(const Polygon& outline, bool anywhere, Region& region,
                                  Displacement& best) const {
  const auto m = static_cast<std::size_t>(best.member);
  const std::vector<Vote> found = votes(outline, region, anywhere);
  const std::vector<Vec2> axes = axes_of(outline);
  const int bared = bared_by(m, region);
  const double lost = unseen_[m] > 0 ? unseen_nats_ * unseen_on(visible({}, m, region), region) : 0;

  struct Trial {
    Vec2 shift;
    int points;
  };
  std::vector<Trial> trials;
  for (std::size_t i = 0; i < std::min<std::size_t>(found.size(), 6); ++i)
    trials.push_back({found[i].by_mm * found[i].axis, found[i].points});
  for (std::size_t i = 0; anywhere && i < std::min<std::size_t>(found.size(), 6); ++i) {
    for (std::size_t k = 0; k < std::min<std::size_t>(found.size(), 12); ++k) {
      if (found[i].axis == found[k].axis) continue;
      trials.push_back({found[i].by_mm * found[i].axis + found[k].by_mm * found[k].axis,
                        found[i].points + found[k].points});
    }
  }
  // Where nothing votes, a crossing that was not seen, or a side laid bare, may tell all the same.
  for (std::size_t i = 0; bared + unseen_[m] > 0 && i < axes.size(); ++i) {
    for (const double by : {-48.0, -32.0, -20.0, -12.0, -6.0, 6.0, 12.0, 20.0, 32.0, 48.0})
      trials.push_back({by * axes[i], 0});
  }
  // The slots that a member off its place has opened itself say where it is.
  const bool off = (centroid(members_[m]) - centroid(outlines_[m])).norm() > kOnEdge_mm;
  bool drawn_known = false;
  for (const Trial& trial : trials) {
    const double most = point_nats_ * (trial.points + bared) + lost;
    if (trial.shift.norm() < kLeast_mm || most < kHopeless_nats) continue;
    const Polygon moved = shifted(outline, trial.shift);
    const Variant part{m, &moved, bounds(moved)};
    if (most - unseen_nats_ * unseen_on(visible(part, m, region), region) < kHopeless_nats) continue;
    if (!drawn_known) region.drawn_nats = score({}, region), drawn_known = true;
    double gain = score(part, region) - region.drawn_nats;
    if (gain < kHopeless_nats || gain <= best.gain_nats) continue;
    if (!off) gain -= slots_nats(part, region);
    if (gain > best.gain_nats) best = {best.member, trial.shift, trial.points, gain};
  }
}

}  // namespace weldcell::localize
