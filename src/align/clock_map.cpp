#include "weldcell/align/clock_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace weldcell::align {
namespace {

constexpr double kBin = 0.25e9;         // ns of device time whose lower hull is kept
constexpr std::size_t kSigmaBins = 12;  // stretches whose separate floors tell how well the floor is known
constexpr double kQuantumNs = 1000;     // device stamps and host stamps are whole microseconds at best

}  // namespace

HostTime ClockMap::to_host(std::int64_t device_ns) const {
  const double x = static_cast<double>(device_ns - device_zero_ns_);
  double offset = 0;
  if (lines_.size() == 1) {
    offset = lines_[0].intercept_ns + lines_[0].slope * x;
  } else {
    const double at = (x - first_centre_ns_) / stride_ns_;
    const double last = static_cast<double>(lines_.size() - 1);
    const double clamped = std::clamp(at, 0.0, last);
    const std::size_t i = std::min(static_cast<std::size_t>(clamped), lines_.size() - 2);
    const double share = clamped - static_cast<double>(i);
    const Line &a = lines_[i], &b = lines_[i + 1];
    offset = (1 - share) * (a.intercept_ns + a.slope * x) + share * (b.intercept_ns + b.slope * x);
  }
  return {host_zero_ns_ + (device_ns - device_zero_ns_) + static_cast<Nanoseconds>(std::floor(offset + 0.5))};
}

void ClockMapBuilder::push(Hull& hull, Vertex vertex) {
  while (hull.size() >= 2) {
    const Vertex &a = hull[hull.size() - 2], &b = hull.back();
    if ((b.x - a.x) * (vertex.y - a.y) - (b.y - a.y) * (vertex.x - a.x) > 0) break;
    hull.pop_back();
  }
  hull.push_back(vertex);
}

void ClockMapBuilder::add(std::int64_t device_ns, HostTime arrival) {
  if (!started_) {
    started_ = true;
    device_zero_ns_ = device_ns;
    host_zero_ns_ = arrival.ns;
  } else if (arrival.ns != pending_arrival_ns_) {
    flush();
  }
  pending_.x = static_cast<double>(device_ns - device_zero_ns_);
  pending_.y = static_cast<double>((arrival.ns - host_zero_ns_) - (device_ns - device_zero_ns_));
  pending_arrival_ns_ = arrival.ns;
}

void ClockMapBuilder::flush() {
  const std::size_t bin = static_cast<std::size_t>(pending_.x / kBin);
  if (bin >= bins_.size()) bins_.resize(bin + 1);
  push(bins_[bin], pending_);
}

ClockMap::Line ClockMapBuilder::fit(const Hull& hull) const {
  const double limit = options_.max_skew_ppm * 1e-6;
  ClockMap::Line line;
  if (hull.size() >= 2) {
    // The line under all points that is closest to them on average is the hull's side above mid-span.
    const double middle = 0.5 * (hull.front().x + hull.back().x);
    std::size_t i = 0;
    while (i + 2 < hull.size() && hull[i + 1].x < middle) ++i;
    line.slope = std::clamp((hull[i + 1].y - hull[i].y) / (hull[i + 1].x - hull[i].x), -limit, limit);
  }
  line.intercept_ns = std::numeric_limits<double>::infinity();
  for (const Vertex& v : hull) line.intercept_ns = std::min(line.intercept_ns, v.y - line.slope * v.x);
  return line;
}

double ClockMapBuilder::stated_sigma_ns(std::size_t first_bin, std::size_t end_bin,
                                        const ClockMap::Line& line) const {
  const std::size_t bins = end_bin - first_bin;
  const std::size_t stretches = std::min(kSigmaBins, bins);
  double sum = 0;
  std::size_t seen = 0;
  for (std::size_t s = 0; s < stretches; ++s) {
    double floor_ns = std::numeric_limits<double>::infinity();
    const std::size_t from = first_bin + s * bins / stretches, to = first_bin + (s + 1) * bins / stretches;
    for (std::size_t b = from; b < to; ++b) {
      for (const Vertex& v : bins_[b])
        floor_ns = std::min(floor_ns, v.y - line.intercept_ns - line.slope * v.x);
    }
    if (std::isfinite(floor_ns)) {
      sum += floor_ns;
      ++seen;
    }
  }
  if (seen == 0) return 1e6;
  // How far the floors of separate stretches stay above the common line: the line itself is known some times
  // better, the fewer the stretches the less so. The factors were set by simulation
  // (tests/unit/align/clock_map_test.cpp).
  const double mean = sum / static_cast<double>(seen);
  const double few = seen >= kSigmaBins ? 0.0 : 20e3 * (1.0 / static_cast<double>(seen) - 1.0 / kSigmaBins);
  return std::sqrt(0.5 * mean * 0.5 * mean + kQuantumNs * kQuantumNs / 12 + few * few);
}

ClockMap ClockMapBuilder::finish() {
  ClockMap map;
  if (!started_) {
    map.lines_.push_back({});
    map.sigma_us_ = 1e6;
    return map;
  }
  flush();
  map.device_zero_ns_ = device_zero_ns_;
  map.host_zero_ns_ = host_zero_ns_;
  const std::size_t per_window =
      std::max<std::size_t>(2, static_cast<std::size_t>(options_.window_s * 1e9 / kBin));
  const std::size_t stride = per_window / 2;
  const std::size_t windows =
      bins_.size() <= per_window + stride ? 1 : (bins_.size() - per_window) / stride + 1;
  map.stride_ns_ = static_cast<double>(stride) * kBin;
  map.first_centre_ns_ = 0.5 * static_cast<double>(per_window) * kBin;
  double variance = 0;
  for (std::size_t w = 0; w < windows; ++w) {
    const std::size_t begin = w * stride, end = w + 1 == windows ? bins_.size() : begin + per_window;
    Hull hull;
    for (std::size_t b = begin; b < end; ++b) {
      for (const Vertex& v : bins_[b]) push(hull, v);
    }
    // A window without any message goes on with the line before it.
    const ClockMap::Line line = hull.empty() && !map.lines_.empty() ? map.lines_.back() : fit(hull);
    const double sigma = stated_sigma_ns(begin, end, line);
    variance += sigma * sigma / static_cast<double>(windows);
    map.skew_ppm_ += line.slope * 1e6 / static_cast<double>(windows);
    map.lines_.push_back(line);
  }
  map.sigma_us_ = std::sqrt(variance) * 1e-3;
  return map;
}

}  // namespace weldcell::align
