#include "candidates.hpp"

#include <algorithm>
#include <cmath>

namespace weldcell::edges {
namespace {

constexpr double kBin = 0.25;           // mm of travel
constexpr std::size_t kWindowBins = 6;  // of each one-sided window
constexpr double kDropout = 0.45;       // mm: shorter ones are bridged
constexpr double kMostlyInvalid = 0.3;  // share of valid readings below which a bin is dark
constexpr double kBesideDropout = 1.2;  // mm: the step and the drop-out are one
constexpr double kOvershoot = 0.8;      // mm beside a drop-out that the sensor distorts

struct Bin {
  double z_mm = 0;
  int valid = 0, invalid = 0;
  bool dark() const { return valid < kMostlyInvalid * (valid + invalid); }
};

struct Bins {
  double origin_mm = 0, width_mm = kBin;
  std::vector<Bin> bins;
  double at(std::size_t i) const { return origin_mm + static_cast<double>(i) * width_mm; }
};

double median_in_place(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

Bins binned(const Run& run) {
  Bins out;
  out.origin_mm = run.s_mm.front();
  const double length = run.s_mm.back() - out.origin_mm;
  out.width_mm = std::max(kBin, 1.2 * length / static_cast<double>(run.points.size()));
  out.bins.resize(static_cast<std::size_t>(length / out.width_mm) + 1);
  std::vector<double> heights;
  std::size_t i = 0;
  for (std::size_t b = 0; b < out.bins.size(); ++b) {
    Bin& bin = out.bins[b];
    heights.clear();
    const bool last = b + 1 == out.bins.size();
    for (; i < run.points.size() && (last || run.s_mm[i] < out.at(b + 1)); ++i) {
      if (run.points[i].code == 0) {
        heights.push_back(static_cast<double>(run.points[i].z_mm));
      } else {
        ++bin.invalid;
      }
    }
    bin.valid = static_cast<int>(heights.size());
    if (!heights.empty()) bin.z_mm = median_in_place(heights);
  }
  return out;
}

/// Median height of the bins [from, to); false when fewer than two of them hold readings.
bool window(const Bins& bins, std::size_t from, std::size_t to, double& z_mm) {
  std::vector<double>::size_type used = 0;
  double values[64];
  for (std::size_t b = from; b < to && used < 64; ++b) {
    if (bins.bins[b].valid > 0 && !bins.bins[b].dark()) values[used++] = bins.bins[b].z_mm;
  }
  if (used < 2) return false;
  std::sort(values, values + used);
  z_mm = 0.5 * (values[(used - 1) / 2] + values[used / 2]);
  return true;
}

/// The place that leaves most readings on their side of half-way: needs no model and bears outliers.
double crossing(const Run& run, double from_mm, double to_mm, double half_mm, int step) {
  const std::size_t begin = index_at(run, from_mm), end = index_at(run, to_mm);
  int score = 0, best = 0;
  double first = 0.5 * (from_mm + to_mm), last = first, before = from_mm;
  bool started = false;
  for (std::size_t i = begin; i < end; ++i) {
    const align::SurfacePoint& p = run.points[i];
    if (p.code != 0) continue;
    const bool upper = static_cast<double>(p.z_mm) > half_mm;
    const double here = 0.5 * (before + run.s_mm[i]);
    if (!started || score > best) {
      best = score;
      first = last = here;
      started = true;
    } else if (score == best) {
      last = here;
    }
    score += (upper == (step < 0)) ? 1 : -1;
    before = run.s_mm[i];
  }
  if (score > best) return before;
  return 0.5 * (first + last);
}

std::vector<Stretch> find_dropouts(const Bins& bins) {
  std::vector<Stretch> out;
  const auto& b = bins.bins;
  std::size_t i = 0;
  while (i < b.size()) {
    if (!b[i].dark() && b[i].valid + b[i].invalid > 0) {
      ++i;
      continue;
    }
    // One lit bin between dark ones is a stray reflection, not the surface.
    std::size_t end = i + 1, dark = b[i].invalid > 0 ? 1 : 0;
    while (end < b.size()) {
      const auto lit = [&](std::size_t k) { return !b[k].dark() && b[k].valid > 0; };
      if (lit(end) && (end + 1 >= b.size() || lit(end + 1))) break;
      dark += b[end].invalid > 0 ? 1 : 0;
      ++end;
    }
    if (dark > 0 && static_cast<double>(end - i) * bins.width_mm >= kDropout)
      out.push_back({bins.at(i), bins.at(end)});
    i = end;
  }
  return out;
}

/// A drop-out with that step already stands for the place.
bool taken(const std::vector<Candidate>& dropouts, const Candidate& c) {
  return std::any_of(dropouts.begin(), dropouts.end(), [&](const Candidate& d) {
    return d.step == c.step && d.hidden.from_mm < c.s_mm + kBesideDropout &&
           d.hidden.to_mm > c.s_mm - kBesideDropout;
  });
}

void score_steps(const Run& run, const Bins& bins, double height_mm, double spot_mm, Candidates& out) {
  const std::vector<Candidate> dropout_steps = out.steps;
  const auto half_gap = static_cast<std::size_t>(std::ceil(0.75 * spot_mm / bins.width_mm));
  const std::size_t reach = half_gap + kWindowBins, count = bins.bins.size();
  if (count < 2 * half_gap + 4) return;
  struct Peak {
    double score = 0, before = 0, after = 0;
    std::size_t first = 0, last = 0;
  } peak;
  const auto close = [&] {
    if (peak.score == 0) return;
    Candidate c;
    c.step = peak.score > 0 ? 1 : -1;
    c.before_mm = peak.before;
    c.after_mm = peak.after;
    const double centre = 0.5 * (bins.at(peak.first) + bins.at(peak.last));
    const double around = static_cast<double>(half_gap + 3) * bins.width_mm;
    c.s_mm = crossing(run, centre - around, centre + around, 0.5 * (c.before_mm + c.after_mm), c.step);
    if (!taken(dropout_steps, c)) out.steps.push_back(c);
    peak = {};
  };
  for (std::size_t k = half_gap + 2; k + half_gap + 2 <= count; ++k) {
    double before = 0, after = 0;
    const bool seen = window(bins, k > reach ? k - reach : 0, k - half_gap, before) &&
                      window(bins, k + half_gap, std::min(count, k + reach), after);
    const double score = seen ? after - before : 0;
    if (std::abs(score) < 0.5 * height_mm || score * peak.score < 0) close();
    if (std::abs(score) < 0.5 * height_mm) continue;
    if (std::abs(score) > 1.02 * std::abs(peak.score)) {
      peak = {score, before, after, k, k};
    } else if (std::abs(score) > 0.96 * std::abs(peak.score)) {
      peak.last = k;
    }
  }
  close();
}

void score_dropouts(const Run& run, const Bins& bins, double height_mm, Candidates& out) {
  const auto clear = static_cast<std::size_t>(std::ceil(kOvershoot / bins.width_mm));
  for (const Stretch& hidden : out.dropouts) {
    const auto begin =
        static_cast<std::size_t>(std::lround((hidden.from_mm - bins.origin_mm) / bins.width_mm));
    const auto end = static_cast<std::size_t>(std::lround((hidden.to_mm - bins.origin_mm) / bins.width_mm));
    const std::size_t count = bins.bins.size();
    Candidate c;
    const std::size_t before_end = begin > clear ? begin - clear : begin;
    const std::size_t after_begin = std::min(count, end + clear);
    if (!window(bins, before_end > kWindowBins ? before_end - kWindowBins : 0, before_end, c.before_mm))
      continue;
    if (!window(bins, after_begin, std::min(count, after_begin + kWindowBins), c.after_mm)) continue;
    if (std::abs(c.after_mm - c.before_mm) < 0.5 * height_mm) continue;
    c.step = c.after_mm > c.before_mm ? 1 : -1;
    c.s_mm = crossing(run, hidden.from_mm - 1, hidden.to_mm + 1, 0.5 * (c.before_mm + c.after_mm), c.step);
    c.beside_dropout = true;
    c.hidden = hidden;
    out.steps.push_back(c);
  }
}

}  // namespace

Candidates find_candidates(const Run& run, double height_mm, double spot_mm) {
  Candidates out;
  if (run.points.size() < 4 || run.s_mm.back() - run.s_mm.front() < 1) return out;
  const Bins bins = binned(run);
  out.dropouts = find_dropouts(bins);
  score_dropouts(run, bins, height_mm, out);
  score_steps(run, bins, height_mm, spot_mm, out);
  std::sort(out.steps.begin(), out.steps.end(), [](const auto& a, const auto& b) { return a.s_mm < b.s_mm; });
  return out;
}

}  // namespace weldcell::edges
