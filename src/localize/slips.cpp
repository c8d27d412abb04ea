#include "slips.hpp"

#include <algorithm>
#include <cmath>

#include "search.hpp"

namespace weldcell::localize {

namespace {

/// Pitches that differ by less are one.
constexpr double kSamePitch_mm = 4;
/// Edges lie on one another when they are this close.
constexpr double kCovered_mm = 6;
constexpr double kSameDirection = 0.998;
constexpr double kLeastOverlap_mm = 20;
/// Share of the outline that must vote for a pitch, and that must then lie on itself.
constexpr double kVotes = 0.25, kCovers = 0.6;
/// So many edges, evenly taken, and places on them tell.
constexpr std::size_t kMostEdges = 200;
constexpr double kMostPlaces = 2000;

struct Pitch {
  Vec2 sum = Vec2::Zero();
  double weight = 0;
  Vec2 mean() const { return sum / weight; }
};

void vote(std::vector<Pitch>& pitches, const Vec2& shift, double weight) {
  auto same = std::find_if(pitches.begin(), pitches.end(),
                           [&](const Pitch& p) { return (p.mean() - shift).norm() < kSamePitch_mm; });
  if (same == pitches.end()) same = pitches.insert(pitches.end(), Pitch{});
  same->sum += weight * shift;
  same->weight += weight;
}

/// Pairs of edges that face one way, side by side: how far one lies beyond the other.
std::vector<Pitch> pitches_of(const std::vector<FieldEdge>& edges) {
  std::vector<Pitch> out;
  double total = 0;
  const std::size_t every = edges.size() / kMostEdges + 1;
  for (std::size_t i = 0; i < edges.size(); i += every) {
    const FieldEdge& from = edges[i];
    total += from.length_mm;
    for (const FieldEdge& to : edges) {
      if (from.outward.dot(to.outward) < kSameDirection) continue;
      const Vec2 d = to.a - from.a;
      const double by = d.dot(from.outward), along = d.dot(from.direction);
      if (std::abs(by) < kShortestSlip_mm || std::abs(by) > kLongestSlip_mm) continue;
      const double overlap = std::min(from.length_mm, along + to.length_mm) - std::max(0.0, along);
      if (overlap >= kLeastOverlap_mm) vote(out, by * from.outward, overlap);
    }
  }
  std::erase_if(out, [&](const Pitch& p) { return p.weight < kVotes * total; });
  std::sort(out.begin(), out.end(),
            [](const Pitch& a, const Pitch& b) { return a.mean().squaredNorm() < b.mean().squaredNorm(); });
  return out;
}

bool covered(const TemplateFields& fields, const FieldEdge& edge, const Vec2& place) {
  const auto near = fields.near(bin_of(std::atan2(-edge.outward.y(), -edge.outward.x())), place);
  return std::any_of(near.begin(), near.end(), [&](std::uint16_t e) {
    const FieldEdge& other = fields.edges()[e];
    const Vec2 d = place - other.a;
    const double along = d.dot(other.direction);
    return other.outward.dot(edge.outward) > kSameDirection && std::abs(d.dot(other.outward)) < kCovered_mm &&
           along > -kCovered_mm && along < other.length_mm + kCovered_mm;
  });
}

/// Share of the outline that lies on the outline once shifted.
double share_covered(const TemplateFields& fields, const Vec2& shift) {
  double length = 0;
  for (const FieldEdge& edge : fields.edges()) length += edge.length_mm;
  const double step = std::max(10.0, length / kMostPlaces);
  int places = 0, on = 0;
  for (const FieldEdge& edge : fields.edges()) {
    for (double at = step / 2; at < edge.length_mm; at += step) {
      ++places;
      on += covered(fields, edge, edge.a + at * edge.direction + shift);
    }
  }
  return places > 0 ? static_cast<double>(on) / places : 0;
}

/// Whether a shift leads where whole steps of the other lead.
bool repeats(const Vec2& shift, const Vec2& other) {
  const double steps = std::round(shift.dot(other) / other.squaredNorm());
  return (shift - steps * other).norm() < kCovered_mm;
}

}  // namespace

std::vector<Vec2> slips_of(const TemplateFields& fields) {
  std::vector<Vec2> out;
  for (const Pitch& pitch : pitches_of(fields.edges())) {
    const Vec2 shift = pitch.mean();
    const bool known = std::any_of(out.begin(), out.end(), [&](const Vec2& o) { return repeats(shift, o); });
    if (!known && share_covered(fields, shift) >= kCovers) out.push_back(shift);
  }
  return out;
}

std::vector<Crossing> sampled_both_ways(const std::vector<Crossing>& crossings, std::size_t count) {
  Vec2 doubled = Vec2::Zero();  // of twice the angle: a side and its opposite face alike
  for (const Crossing& c : crossings) {
    const Vec2& n = c.inward;
    doubled += Vec2(n.x() * n.x() - n.y() * n.y(), 2 * n.x() * n.y());
  }
  std::vector<Crossing> along, across;
  for (const Crossing& c : crossings) {
    const Vec2& n = c.inward;
    const bool most = doubled.dot(Vec2(n.x() * n.x() - n.y() * n.y(), 2 * n.x() * n.y())) >= 0;
    (most ? along : across).push_back(c);
  }
  std::vector<Crossing> out = sampled(across, count / 2);
  const std::vector<Crossing> rest = sampled(along, count - out.size());
  out.insert(out.end(), rest.begin(), rest.end());
  return out;
}

}  // namespace weldcell::localize
