#include <algorithm>
#include <cmath>

#include "cad/outline.hpp"

namespace weldcell::cad {

namespace {

double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }

/// The middle line of the stretch where two sides face each other at most gap_mm apart; empty when there is
/// none.
std::vector<Segment> facing(const Segment& a, const Segment& b, double gap_mm) {
  const double length = a.length();
  if (length < 1e-6 || b.length() < 1e-6) return {};
  const Vec2 axis = a.direction();
  if (std::abs(cross(axis, b.direction())) > 0.02) return {};
  const double b0 = (b.a - a.a).dot(axis), b1 = (b.b - a.a).dot(axis);
  const double from = std::max(0.0, std::min(b0, b1)), to = std::min(length, std::max(b0, b1));
  if (to - from < 1e-3) return {};
  const auto across_b = [&](double along) {
    const double t = (along - b0) / (b1 - b0);
    return cross(axis, b.a + t * (b.b - b.a) - a.a);
  };
  const double gap_from = across_b(from), gap_to = across_b(to);
  if (std::abs(gap_from) > gap_mm || std::abs(gap_to) > gap_mm) return {};
  const Vec2 left(-axis.y(), axis.x());
  return {{a.a + from * axis + gap_from / 2 * left, a.a + to * axis + gap_to / 2 * left}};
}

std::vector<Segment> all_facing(const Polygon& a, const Polygon& b, double gap_mm) {
  std::vector<Segment> out;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Segment side{a[i], a[(i + 1) % a.size()]};
    for (std::size_t k = 0; k < b.size(); ++k) {
      for (const Segment& s : facing(side, {b[k], b[(k + 1) % b.size()]}, gap_mm)) out.push_back(s);
    }
  }
  return out;
}

double path_length(const std::vector<Vec2>& path) {
  double length = 0;
  for (std::size_t i = 1; i < path.size(); ++i) length += (path[i] - path[i - 1]).norm();
  return length;
}

/// Points on the line between their neighbours are left out.
std::vector<Vec2> without_straight_points(const std::vector<Vec2>& path) {
  std::vector<Vec2> out{path.front()};
  for (std::size_t i = 1; i + 1 < path.size(); ++i) {
    if (distance(path[i], {out.back(), path[i + 1]}) > 0.01) out.push_back(path[i]);
  }
  out.push_back(path.back());
  return out;
}

}  // namespace

double contact_length(const Polygon& a, const Polygon& b, double gap_mm) {
  double length = 0;
  for (const Segment& s : all_facing(a, b, gap_mm)) length += s.length();
  return length;
}

std::vector<std::vector<Vec2>> contact_lines(const Polygon& a, const Polygon& b, double gap_mm,
                                             double min_length_mm) {
  constexpr double kJoinMm = 0.6;
  std::vector<Segment> pieces = all_facing(a, b, gap_mm);
  std::vector<std::vector<Vec2>> out;
  while (!pieces.empty()) {
    std::vector<Vec2> path{pieces.front().a, pieces.front().b};
    pieces.erase(pieces.begin());
    bool grown = true;
    while (grown) {
      grown = false;
      for (std::size_t i = 0; i < pieces.size() && !grown; ++i) {
        const Segment s = pieces[i];
        grown = true;
        if ((s.a - path.back()).norm() < kJoinMm)
          path.push_back(s.b);
        else if ((s.b - path.back()).norm() < kJoinMm)
          path.push_back(s.a);
        else if ((s.b - path.front()).norm() < kJoinMm)
          path.insert(path.begin(), s.a);
        else if ((s.a - path.front()).norm() < kJoinMm)
          path.insert(path.begin(), s.b);
        else
          grown = false;
        if (grown) pieces.erase(pieces.begin() + static_cast<std::ptrdiff_t>(i));
      }
    }
    if (path_length(path) < min_length_mm) continue;
    path = without_straight_points(path);
    const Vec2 way = path.back() - path.front();
    if (way.x() < -1e-6 || (std::abs(way.x()) <= 1e-6 && way.y() < 0)) std::reverse(path.begin(), path.end());
    out.push_back(std::move(path));
  }
  return out;
}

double overlap_depth(const Polygon& a, const Polygon& b) {
  double deepest = 0;
  const auto probe = [&](const Polygon& inner, const Polygon& outer) {
    for (std::size_t i = 0; i < inner.size(); ++i) {
      const Vec2& p = inner[i];
      for (const Vec2& q : {p, Vec2((p + inner[(i + 1) % inner.size()]) / 2)}) {
        if (!contains(outer, q)) continue;
        double to_side = 1e9;
        for (std::size_t k = 0; k < outer.size(); ++k) {
          to_side = std::min(to_side, distance(q, {outer[k], outer[(k + 1) % outer.size()]}));
        }
        deepest = std::max(deepest, to_side);
      }
    }
  };
  probe(a, b);
  probe(b, a);
  return deepest;
}

}  // namespace weldcell::cad
