#include "cad/outline.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "weldcell/base/units.hpp"
#include "weldcell/geometry/boxes.hpp"

namespace weldcell::cad {

namespace {

double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Where along s (0..1) other segments' ends or crossings cut it.
void add_cuts(const Segment& s, const Segment& other, double weld_mm, std::vector<double>& cuts) {
  const Vec2 d = s.b - s.a;
  const double length2 = d.squaredNorm();
  for (const Vec2* p : {&other.a, &other.b}) {
    if (distance(*p, s) < weld_mm) cuts.push_back((*p - s.a).dot(d) / length2);
  }
  const Vec2 e = other.b - other.a;
  const double denominator = cross(d, e);
  if (std::abs(denominator) < 1e-9 * d.norm() * e.norm()) return;
  const double t = cross(other.a - s.a, e) / denominator;
  const double u = cross(other.a - s.a, d) / denominator;
  if (t > 0 && t < 1 && u > 0 && u < 1) cuts.push_back(t);
}

using Graph = std::map<int, std::set<int>>;

Graph arrangement(const std::vector<Segment>& segments, double weld_mm, PointPool& pool) {
  Graph graph;
  std::vector<Box2> boxes;
  for (const Segment& s : segments) boxes.push_back(grown(bounds(s), weld_mm));
  std::vector<double> cuts;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    const Segment& s = segments[i];
    if (s.length() < weld_mm) continue;
    cuts = {0, 1};
    for (std::size_t k = 0; k < segments.size(); ++k) {
      if (k != i && !apart(boxes[i], boxes[k])) add_cuts(s, segments[k], weld_mm, cuts);
    }
    std::sort(cuts.begin(), cuts.end());
    int last = pool.id(s.a);
    for (const double t : cuts) {
      const int next = pool.id(s.a + std::clamp(t, 0.0, 1.0) * (s.b - s.a));
      if (next == last) continue;
      graph[last].insert(next);
      graph[next].insert(last);
      last = next;
    }
  }
  return graph;
}

void prune_dead_ends(Graph& graph) {
  std::vector<int> open;
  for (const auto& [id, neighbours] : graph) {
    if (neighbours.size() == 1) open.push_back(id);
  }
  while (!open.empty()) {
    const int id = open.back();
    open.pop_back();
    auto at = graph.find(id);
    if (at == graph.end() || at->second.size() != 1) continue;
    const int neighbour = *at->second.begin();
    graph.erase(at);
    graph[neighbour].erase(id);
    if (graph[neighbour].size() == 1) open.push_back(neighbour);
    if (graph[neighbour].empty()) graph.erase(neighbour);
  }
}

Polygon without_straight_vertices(Polygon out, double tolerance_mm) {
  bool changed = true;
  // A vertex leaves when every original point that its chord would then span stays within the tolerance.
  std::vector<std::vector<Vec2>> spanned(out.size());
  while (changed && out.size() > 3) {
    changed = false;
    for (std::size_t i = 0; i < out.size() && out.size() > 3; ++i) {
      const std::size_t before = (i + out.size() - 1) % out.size(), after = (i + 1) % out.size();
      const Segment chord{out[before], out[after]};
      bool straight = distance(out[i], chord) < tolerance_mm;
      for (const std::vector<Vec2>* points : {&spanned[before], &spanned[i]}) {
        for (const Vec2& p : *points) straight = straight && distance(p, chord) < tolerance_mm;
      }
      if (!straight) continue;
      spanned[before].push_back(out[i]);
      spanned[before].insert(spanned[before].end(), spanned[i].begin(), spanned[i].end());
      out.erase(out.begin() + static_cast<std::ptrdiff_t>(i));
      spanned.erase(spanned.begin() + static_cast<std::ptrdiff_t>(i));
      changed = true;
      break;
    }
  }
  return out;
}

}  // namespace

int PointPool::id(const Vec2& p) {
  const auto cell = [&](double v) { return static_cast<long long>(std::floor(v / tolerance_mm_)); };
  const long long cx = cell(p.x()), cy = cell(p.y());
  int best = -1;
  double best_distance = tolerance_mm_;
  for (long long dx = -1; dx <= 1; ++dx) {
    const auto from = std::lower_bound(
        cells_.begin(), cells_.end(), std::pair{std::pair{cx + dx, cy - 1}, std::numeric_limits<int>::min()});
    for (auto at = from; at != cells_.end() && at->first <= std::pair{cx + dx, cy + 1}; ++at) {
      const double d = (points_[static_cast<std::size_t>(at->second)] - p).norm();
      if (d < best_distance) {
        best_distance = d;
        best = at->second;
      }
    }
  }
  if (best >= 0) return best;
  const int fresh = static_cast<int>(points_.size());
  points_.push_back(p);
  const std::pair entry{std::pair{cx, cy}, fresh};
  cells_.insert(std::lower_bound(cells_.begin(), cells_.end(), entry), entry);
  return fresh;
}

std::optional<Polygon> outer_boundary(const std::vector<Segment>& segments, double weld_mm) {
  PointPool pool(weld_mm);
  Graph graph = arrangement(segments, weld_mm, pool);
  prune_dead_ends(graph);
  if (graph.empty()) return std::nullopt;
  int start = graph.begin()->first;
  for (const auto& [id, neighbours] : graph) {
    const Vec2 &p = pool.point(id), &q = pool.point(start);
    if (p.x() < q.x() || (p.x() == q.x() && p.y() < q.y())) start = id;
  }
  // Interior to the left, so the rightmost turn at every point keeps to the outside. From the leftmost point
  // everything else lies to the right, and an arrival from above makes its lowest way out the rightmost turn.
  Polygon out;
  int at = start, first_next = -1;
  Vec2 incoming(0, -1);
  for (std::size_t steps = 0; steps <= 4 * pool.size() + 4; ++steps) {
    int next = -1;
    double best_turn = std::numeric_limits<double>::max();
    for (const int candidate : graph[at]) {
      const Vec2 way = (pool.point(candidate) - pool.point(at)).normalized();
      double turn = std::atan2(cross(incoming, way), incoming.dot(way));
      if (turn < -kPi + 1e-9) turn = kPi;
      if (turn < best_turn) {
        best_turn = turn;
        next = candidate;
      }
    }
    if (next < 0 || (at == start && next == first_next)) break;
    if (at == start && first_next < 0) first_next = next;
    out.push_back(pool.point(at));
    incoming = (pool.point(next) - pool.point(at)).normalized();
    at = next;
  }
  if (at != start || out.size() < 3 || signed_area(out) <= 0) return std::nullopt;
  const Box2 box = bounds(out);
  for (const auto& [id, neighbours] : graph) {
    const Vec2& p = pool.point(id);
    const bool outside =
        (p.array() < box.min.array() - 0.05).any() || (p.array() > box.max.array() + 0.05).any();
    if (outside) return std::nullopt;
  }
  return out;
}

Polygon straightened(const Polygon& polygon, double tolerance_mm) {
  // Points on straight sides first: else a corner may leave for a point of the same side close beside it.
  return without_straight_vertices(without_straight_vertices(polygon, 5e-5), tolerance_mm);
}

Vec2 main_axis(const Polygon& polygon) {
  Vec2 axis(1, 0);
  double longest = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2 side = polygon[(i + 1) % polygon.size()] - polygon[i];
    if (side.norm() > longest + 1e-6) {
      longest = side.norm();
      axis = side / longest;
    }
  }
  return axis;
}

std::vector<std::size_t> long_sides(const Polygon& polygon) {
  const Vec2 axis = main_axis(polygon);
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2 side = polygon[(i + 1) % polygon.size()] - polygon[i];
    if (side.norm() > 1e-6 && std::abs(cross(side.normalized(), axis)) < 0.01) out.push_back(i);
  }
  return out;
}

Polygon widened(const Polygon& polygon, double distance_mm) {
  Polygon ccw = polygon;
  if (signed_area(ccw) < 0) std::reverse(ccw.begin(), ccw.end());
  const std::size_t n = ccw.size();
  std::vector<double> move(n, 0.0);
  for (const std::size_t i : long_sides(ccw)) move[i] = distance_mm;
  Polygon out;
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t before = (i + n - 1) % n;
    const Vec2 d0 = (ccw[i] - ccw[before]).normalized(), d1 = (ccw[(i + 1) % n] - ccw[i]).normalized();
    const Vec2 n0(d0.y(), -d0.x()), n1(d1.y(), -d1.x());
    const Vec2 p0 = ccw[before] + move[before] * n0, p1 = ccw[i] + move[i] * n1;
    const double denominator = cross(d0, d1);
    out.push_back(std::abs(denominator) < 1e-6 ? p1 : p0 + d0 * (cross(p1 - p0, d1) / denominator));
  }
  return out;
}

double width_across(const Polygon& polygon) {
  const Vec2 axis = main_axis(polygon);
  double low = std::numeric_limits<double>::max(), high = std::numeric_limits<double>::lowest();
  for (const Vec2& p : polygon) {
    low = std::min(low, cross(axis, p));
    high = std::max(high, cross(axis, p));
  }
  return high - low;
}

}  // namespace weldcell::cad
