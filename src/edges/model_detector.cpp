#include <algorithm>
#include <cmath>

#include "detectors.hpp"
#include "step_fit.hpp"

namespace weldcell::edges {
namespace {

constexpr double kReach = 8.0;         // mm of plateau used on each side: more would gain < 4 % in sigma
constexpr double kShortReach = 3.0;    // second try, when something else stands on the plateau
constexpr double kLeastPlateau = 0.8;  // mm on each side
constexpr double kGroup = 0.125;       // of the blur: readings closer than this are averaged
constexpr double kWidestBlur = 3.5;    // times the expected: a ramp, not a step
constexpr double kMostOutliers = 0.35;
constexpr double kMostChi2 = 9.0;
constexpr double kWidestBracket = 2.0;  // mm without a reading at the step
constexpr double kDarkens = 3.1;        // times the blur: a shorter shadow leaves no reading without light
constexpr double kFarthest = 1.5;       // mm between candidate and fit

/// Valid readings around the candidate, u towards the upper side, close ones averaged without their strays.
std::vector<Sample> grouped(const Run& run, const Candidate& c, double from_mm, double to_mm, double group_mm,
                            double noise_mm) {
  std::vector<Sample> out;
  std::vector<double> z;
  double sum_u = 0, first_u = 0;
  const auto close = [&] {
    if (z.empty()) return;
    Sample s;
    s.u_mm = sum_u / static_cast<double>(z.size());
    s.count = static_cast<int>(z.size());
    if (z.size() >= 3) {
      std::vector<double> sorted = z;
      std::sort(sorted.begin(), sorted.end());
      const double median = sorted[sorted.size() / 2];
      const double spread = sorted[(3 * sorted.size()) / 4] - sorted[sorted.size() / 4];
      const double limit = std::max(4 * noise_mm, 3 * spread);
      std::erase_if(z, [&](double v) { return std::abs(v - median) > limit; });
      s.count = static_cast<int>(z.size());
    }
    for (const double v : z) s.z_mm += v / static_cast<double>(z.size());
    out.push_back(s);
    z.clear();
    sum_u = 0;
  };
  const std::size_t begin = index_at(run, from_mm), end = index_at(run, to_mm);
  for (std::size_t i = begin; i < end; ++i) {
    const align::SurfacePoint& p = run.points[i];
    if (p.code != 0) continue;
    const double u = c.step * (run.s_mm[i] - c.s_mm);
    if (!z.empty() && std::abs(u - first_u) >= group_mm) close();
    if (z.empty()) first_u = u;
    sum_u += u;
    z.push_back(static_cast<double>(p.z_mm));
  }
  close();
  if (c.step < 0) std::reverse(out.begin(), out.end());
  return out;
}

double expected_blur(const EdgeOptions& options) { return options.spot_mm / 4; }

StepFit fit_within(const Run& run, const Candidate& c, double from_mm, double to_mm,
                   const EdgeOptions& options) {
  FitOptions fit;
  fit.noise_mm = options.noise_mm;
  fit.expected_blur_mm = expected_blur(options);
  fit.height_mm = options.height_mm;
  return fit_step(grouped(run, c, from_mm, to_mm, kGroup * fit.expected_blur_mm, options.noise_mm), fit);
}

/// What the readings around the crossing say without any model of the transition.
struct Jump {
  bool jumps = false;
  double s_mm = 0, bracket_mm = 0;
  double low_mm = 0, high_mm = 0;
};

double median_height(const Run& run, double from_mm, double to_mm) {
  std::vector<double> z;
  const std::size_t begin = index_at(run, from_mm), end = index_at(run, to_mm);
  for (std::size_t i = begin; i < end; ++i) {
    if (run.points[i].code == 0) z.push_back(static_cast<double>(run.points[i].z_mm));
  }
  if (z.empty()) return 0;
  const auto middle = z.begin() + static_cast<std::ptrdiff_t>(z.size() / 2);
  std::nth_element(z.begin(), middle, z.end());
  return *middle;
}

/// A sensor that reads the brighter of two images leaves the middle of the height empty; a blurred step fills
/// it with readings over 1.68 times the blur (20 to 80 %).
Jump find_jump(const Run& run, const Candidate& c, double from_mm, double to_mm, double blur_mm) {
  Jump out;
  const double low = std::min(c.before_mm, c.after_mm), high = std::max(c.before_mm, c.after_mm);
  const double around = 6 * blur_mm;
  const std::size_t begin = index_at(run, std::max(from_mm, c.s_mm - around));
  const std::size_t end = index_at(run, std::min(to_mm, c.s_mm + around));
  int valid = 0, middle = 0;
  double before = from_mm, after = to_mm;
  for (std::size_t i = begin; i < end; ++i) {
    if (run.points[i].code != 0) continue;
    ++valid;
    const double share = (static_cast<double>(run.points[i].z_mm) - low) / (high - low);
    if (share > 0.2 && share < 0.8 && std::abs(run.s_mm[i] - c.s_mm) < 2 * blur_mm) ++middle;
    if (run.s_mm[i] <= c.s_mm) before = std::max(before, run.s_mm[i]);
    if (run.s_mm[i] > c.s_mm) after = std::min(after, run.s_mm[i]);
  }
  if (end <= begin + 1 || valid < 2) return out;
  const double spacing = (run.s_mm[end - 1] - run.s_mm[begin]) / static_cast<double>(end - begin - 1);
  const double expected = 1.68 * blur_mm / spacing;
  out.jumps = middle == 0 || (expected > 2 && middle < 0.3 * expected);
  out.bracket_mm = after - before;
  out.s_mm = 0.5 * (before + after);
  const double half_before = 0.5 * (from_mm + c.s_mm), half_after = 0.5 * (to_mm + c.s_mm);
  const double first = median_height(run, from_mm, half_before),
               second = median_height(run, half_after, to_mm);
  out.low_mm = std::min(first, second);
  out.high_mm = std::max(first, second);
  return out;
}

bool believable(const StepFit& fit, const EdgeOptions& options) {
  return fit.usable && fit.outliers <= kMostOutliers && fit.chi2 <= kMostChi2 &&
         fit.model.blur_mm <= kWidestBlur * expected_blur(options) &&
         std::abs(fit.model.position_mm) <= kFarthest;
}

}  // namespace

bool height_fits(double height_mm, const EdgeOptions& options) {
  return std::abs(height_mm - options.height_mm) <= options.height_tolerance * options.height_mm;
}

namespace {

/// A shadow that ends before the spot has left the upper side darkens no reading, but moves the crossing
/// outwards by half its length.
void correct_short_shadow(const Run& run, const Candidate& c, const EdgeOptions& options, double bracket_mm,
                          Located& located) {
  const Crossing crossing = crossing_of(run, c, options);
  const double longest = kDarkens * expected_blur(options) / crossing.square;
  // Where readings stand that a shadow as long as this would have darkened, the sensor throws none.
  const double dark = crossing.hidden_mm - longest;
  if (dark < 0.6 || bracket_mm > 0.3 * dark) {
    located.s_mm += c.step * 0.5 * crossing.hidden_mm;
    located.sigma_mm = std::hypot(located.sigma_mm, 0.05 * crossing.hidden_mm);
  }
  if (!crossing.normal_known) {
    // One side of a bar crossed obliquely may have such a shadow, uniform up to the longest; the other has
    // none.
    const double shift = 0.5 * std::min(longest, options.height_mm * std::tan(options.triangulation_rad));
    located.sigma_mm = std::hypot(located.sigma_mm, shift / std::sqrt(6.0));
  }
}

}  // namespace

Located locate_by_model(const Run& run, const Candidate& c, double from_mm, double to_mm,
                        const EdgeOptions& options, EdgeSummary& summary) {
  Located out;
  if (c.s_mm - from_mm < kLeastPlateau || to_mm - c.s_mm < kLeastPlateau) {
    ++summary.bad_fit;
    return out;
  }
  const Jump jump = find_jump(run, c, std::max(from_mm, c.s_mm - kReach), std::min(to_mm, c.s_mm + kReach),
                              expected_blur(options));
  if (jump.jumps) {
    if (jump.bracket_mm > kWidestBracket) {
      ++summary.bad_fit;
      return out;
    }
    if (!height_fits(jump.high_mm - jump.low_mm, options)) {
      ++summary.bad_height;
      return out;
    }
    out = {true, jump.s_mm, jump.bracket_mm / std::sqrt(12.0), jump.high_mm, jump.low_mm, false};
    correct_short_shadow(run, c, options, jump.bracket_mm, out);
    return out;
  }
  const auto fit_with_reach = [&](double reach) {
    return fit_within(run, c, std::max(from_mm, c.s_mm - reach), std::min(to_mm, c.s_mm + reach), options);
  };
  StepFit fit = fit_with_reach(kReach);
  if (!believable(fit, options)) fit = fit_with_reach(kShortReach);
  if (!believable(fit, options)) {
    ++summary.bad_fit;
    return out;
  }
  if (!height_fits(fit.model.height_mm(), options)) {
    ++summary.bad_height;
    return out;
  }
  out.accepted = true;
  out.s_mm = c.s_mm + c.step * fit.model.position_mm;
  out.sigma_mm = fit.sigma_mm * std::sqrt(std::max(1.0, fit.chi2));
  out.top_mm = fit.model.high_mm + fit.model.slope * fit.model.position_mm;
  out.table_mm = fit.model.low_mm + fit.model.slope * fit.model.position_mm;
  correct_short_shadow(run, c, options, fit.bracket_mm, out);
  return out;
}

void add_edge(const Run& run, const Located& located, int step, const EdgeOptions& options, EdgeScan& out) {
  const double clearance = located.shadowed ? 0.0 : 0.5 * expected_blur(options);
  const Place place = place_at(run, located.s_mm, step, clearance);
  EdgePoint edge;
  edge.x_mm = place.x_mm;
  edge.y_mm = place.y_mm;
  edge.dir_x = place.dir_x;
  edge.dir_y = place.dir_y;
  edge.step = step;
  edge.speed_mm_s = place.speed_mm_s;
  const double by_time = place.speed_mm_s * options.time_sigma_s;
  edge.sigma_mm = std::sqrt(located.sigma_mm * located.sigma_mm + by_time * by_time +
                            options.model_sigma_mm * options.model_sigma_mm);
  edge.shadowed = located.shadowed;
  out.edges.push_back(edge);
  out.top_z_mm.push_back(located.top_mm);
  out.table_z_mm.push_back(located.table_mm);
  ++out.summary.accepted;
  if (located.shadowed) ++out.summary.shadowed;
}

}  // namespace weldcell::edges
