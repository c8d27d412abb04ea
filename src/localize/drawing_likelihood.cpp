// What points and travel say of a drawing: Alternatives' log-likelihoods.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "alternatives.hpp"
#include "weldcell/geometry/boxes.hpp"

namespace weldcell::localize {

namespace {

using workpiece::VisibleEdge;

/// A crossing is seen when a point of its sign lies this close to it.
constexpr double kSeenAt_mm = 5;
/// A joint of members that are a little off is closed to the beam all the same.
constexpr double kClosed_mm = 2;
/// A joint that stands open by less may hide its sides, from where the receiver looks across it.
constexpr double kNarrow_mm = 6;
/// Beam and noise decide nearer to the end of an edge.
constexpr double kLeastEndMargin_mm = 1.5;

}  // namespace

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
      if (!contains(region.box, place)) continue;
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
    free += s->free && contains(box, s->place);
  return point_nats_ * free + unseen_nats_ * std::accumulate(unseen_.begin(), unseen_.end(), 0);
}

double Alternatives::missing(int member) const {
  const auto m = static_cast<std::size_t>(member);
  Region region = around(m);
  note_near(m, region);
  const Polygon nothing;
  return score({m, &nothing, boxes_[m]}, region) - score({}, region);
}

}  // namespace weldcell::localize
