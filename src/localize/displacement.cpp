// Where a member lies that is not where the drawing has it: Alternatives' search for displacements.
#include <algorithm>
#include <cmath>

#include "alternatives.hpp"
#include "weldcell/geometry/boxes.hpp"

namespace weldcell::localize {

namespace {

/// Below this nothing is worth a closer look.
constexpr double kHopeless_nats = 3;

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

double Alternatives::places_nats() const {
  double out = 1;
  for (const Polygon& outline : outlines_)
    out += static_cast<double>(axes_of(outline).size()) * 2 * (kMost_mm - kLeast_mm) / (2 * kOnEdge_mm);
  return std::log(out);
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
    if (!s.free || !contains(box, s.place)) continue;
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
    if (!s.free || !contains(box, s.place)) continue;
    bool on_hidden_side = false;
    for (std::size_t m = 0; m < members_.size() && !on_hidden_side; ++m) {
      const Polygon& other = members_[m];
      if (m == member || !contains(grown(boxes_[m], kOnEdge_mm), s.place)) continue;
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
