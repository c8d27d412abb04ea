#include <algorithm>
#include <cmath>
#include <numbers>

#include "detectors.hpp"

namespace weldcell::edges {
namespace {

constexpr double kIsland = 0.3;          // mm of drop-out that ends the upper side
constexpr double kSurelyTowards = 0.25;  // cosine beyond which even a short drop-out is a shadow
constexpr double kSurelyAway = -0.6;     // cosine below which no oblique edge throws one, its normal unknown
constexpr int kExposureReadings = 5;  // that the sensor's exposure control may lose at a change of brightness
constexpr double kOutlineReach =
    6.0;  // mm between a candidate and the side of the outline that it is taken for
constexpr double kThresholdSpread =
    0.5;  // of the blur: how well light_threshold is known (2 % .. 15 % of the light)
constexpr double kRoundingFrom = 0.9,
                 kRoundingTo = 9.0;  // mm inside the edge that show the corner's rounding

/// x with Phi(x) = share, by bisection: called once an edge.
double normal_quantile(double share) {
  double low = -6, high = 6;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (0.5 * std::erfc(-middle / std::numbers::sqrt2) < share ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

struct UpperEnd {
  bool found = false;
  double last_mm = 0;     ///< s of the last reading of the upper side
  double spacing_mm = 0;  ///< between readings there
};

/// Walks from the upper plateau into the drop-out.
UpperEnd upper_end(const Run& run, const Candidate& c, double half_mm) {
  UpperEnd out;
  const double start = c.step > 0 ? c.hidden.to_mm + 2 : c.hidden.from_mm - 2;
  const double limit = c.step > 0 ? c.hidden.from_mm : c.hidden.to_mm;
  const int toward = -c.step;
  auto i = static_cast<std::ptrdiff_t>(std::min(index_at(run, start), run.points.size() - 1));
  const auto count = static_cast<std::ptrdiff_t>(run.points.size());
  double last = start, before = start;
  for (; i >= 0 && i < count; i += toward) {
    const auto k = static_cast<std::size_t>(i);
    const double s = run.s_mm[k];
    if ((limit - s) * toward < 0) break;
    if (out.found && (s - last) * toward > kIsland) break;
    if (run.points[k].code != 0 || static_cast<double>(run.points[k].z_mm) < half_mm) continue;
    before = last;
    last = s;
    out.found = true;
  }
  out.last_mm = last;
  // The neighbour beyond tells the spacing even when the readings before were sparse.
  out.spacing_mm = std::abs(last - before);
  const auto next = i >= 0 && i < count ? index_at(run, last) : run.points.size();
  if (next > 0 && next + 1 < run.points.size()) {
    out.spacing_mm = 0.5 * (run.s_mm[next + 1] - run.s_mm[next - 1]);
  }
  return out;
}

/// Radius of the quarter circle whose silhouette lies at s_mm, 0 when the corner is sharp. Least squares over
/// a grid.
double corner_radius(const Run& run, const Candidate& c, double s_mm, double square, double noise_mm) {
  struct Sum {
    double inside, z;
  };
  std::vector<Sum> samples;
  const double a = s_mm + c.step * kRoundingFrom, b = s_mm + c.step * kRoundingTo;
  const std::size_t begin = index_at(run, std::min(a, b)), end = index_at(run, std::max(a, b));
  const std::size_t every = std::max<std::size_t>(1, (end - begin) / 200);
  for (std::size_t i = begin; i < end; i += every) {
    if (run.points[i].code != 0) continue;
    samples.push_back({c.step * (run.s_mm[i] - s_mm) * square, static_cast<double>(run.points[i].z_mm)});
  }
  if (samples.size() < 8) return 0;
  double best = 0, best_cost = 0;
  for (int k = 0; k <= 32; ++k) {
    const double r = 0.25 * k;
    std::vector<double> level;
    for (const Sum& s : samples) {
      const double x = r - s.inside;
      level.push_back(s.z + (x > 0 ? r - std::sqrt(r * r - x * x) : 0));
    }
    const auto middle = level.begin() + static_cast<std::ptrdiff_t>(level.size() / 2);
    std::nth_element(level.begin(), middle, level.end());
    const double top = *middle;
    double cost = 0;
    for (const double z : level) cost += std::min(std::abs(z - top), 6 * noise_mm);
    if (k == 0 || cost < 0.97 * best_cost) {
      best = r;
      best_cost = cost;
    }
  }
  return best;
}

}  // namespace

Crossing crossing_of(const Run& run, const Candidate& c, const EdgeOptions& options) {
  const align::SurfacePoint& p = run.points[std::min(index_at(run, c.s_mm), run.points.size() - 1)];
  const Vec2 at(static_cast<double>(p.x_mm), static_cast<double>(p.y_mm));
  const Vec2 travel = Vec2(static_cast<double>(p.vx_mm_s), static_cast<double>(p.vy_mm_s)) / speed_mm_s(p);
  const Vec2 receiver(static_cast<double>(p.receiver_x), static_cast<double>(p.receiver_y));
  Crossing out;
  out.towards = c.step * travel.dot(receiver);
  double nearest = kOutlineReach;
  for (const Segment& side : options.outline) {
    const double away = distance(at, side);
    if (away >= nearest) continue;
    const Vec2 along = side.direction();
    const Vec2 inward(-along.y(), along.x());
    const double square = c.step * inward.dot(travel);
    // The step's sign excludes the sides that the beam would cross the other way.
    if (square <= 0) continue;
    nearest = away;
    out.normal_known = true;
    out.square = square;
    out.towards = inward.dot(receiver);
  }
  out.hidden_mm = options.height_mm * std::tan(options.triangulation_rad) * std::max(0.0, out.towards) /
                  std::max(out.square, kGlancing);
  return out;
}

bool is_shadow(const Run& run, const Candidate& c, const EdgeOptions& options) {
  const Crossing crossing = crossing_of(run, c, options);
  const double seen = c.hidden.to_mm - c.hidden.from_mm;
  const double longest = options.height_mm * std::tan(options.triangulation_rad) / crossing.square;
  if (seen > 2 * longest + 3) return false;
  if (crossing.towards >= kSurelyTowards) return seen >= 0.3 * crossing.hidden_mm - 1;
  const auto readings = static_cast<int>(index_at(run, c.hidden.to_mm) - index_at(run, c.hidden.from_mm));
  if (readings <= kExposureReadings) return false;
  return crossing.towards > (crossing.normal_known ? 0.0 : kSurelyAway);
}

Located locate_by_shadow(const Run& run, const Candidate& c, const EdgeOptions& options,
                         EdgeSummary& summary) {
  Located out;
  const double top = std::max(c.before_mm, c.after_mm), table = std::min(c.before_mm, c.after_mm);
  if (!height_fits(top - table, options)) {
    ++summary.bad_height;
    return out;
  }
  const UpperEnd end = upper_end(run, c, 0.5 * (top + table));
  if (!end.found) {
    ++summary.bad_fit;
    return out;
  }
  const Crossing crossing = crossing_of(run, c, options);
  const double blur = options.spot_mm / 4;
  const double threshold = -normal_quantile(options.light_threshold);
  double s = end.last_mm + c.step * (threshold * blur / crossing.square - 0.5 * end.spacing_mm);
  const double radius = corner_radius(run, c, s, crossing.square, options.noise_mm);
  // Where the corner is steeper than the line of sight the receiver sees nothing of it any more. An edge
  // crossed obliquely, its normal unknown, tells the line of sight by how long the foot stays dark.
  const double steepest = std::tan(options.triangulation_rad);
  const double dark = c.hidden.to_mm - c.hidden.from_mm + 2 * threshold * blur;
  const bool told = crossing.normal_known || crossing.towards >= kSurelyTowards;
  const double slope =
      told ? steepest * std::max(0.0, crossing.towards) : std::min(steepest, dark / options.height_mm);
  const double hidden_corner = radius * (1 - std::cos(std::atan(slope))) / crossing.square;
  s -= c.step * hidden_corner;
  out.accepted = true;
  out.shadowed = true;
  out.s_mm = s;
  const double by_threshold = kThresholdSpread * blur, by_corner = 0.3 * hidden_corner;
  out.sigma_mm =
      std::sqrt(by_threshold * by_threshold + end.spacing_mm * end.spacing_mm / 12 + by_corner * by_corner);
  out.top_mm = top;
  out.table_mm = table;
  return out;
}

}  // namespace weldcell::edges
