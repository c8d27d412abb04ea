#include "beam_curve.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "weldcell/base/assert.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::plan {

Blend::Blend(const BeamState& from, const BeamState& to, double duration_s) : duration_s_(duration_s) {
  const double t = duration_s;
  const Eigen::Vector3d way = to.place - from.place - t * from.rate - t * t / 2 * from.acceleration;
  const Eigen::Vector3d rate = (to.rate - from.rate - t * from.acceleration) * t;
  const Eigen::Vector3d bend = (to.acceleration - from.acceleration) * t * t;
  coefficient_.col(0) = from.place;
  coefficient_.col(1) = from.rate;
  coefficient_.col(2) = from.acceleration / 2;
  coefficient_.col(3) = (10 * way - 4 * rate + bend / 2) / (t * t * t);
  coefficient_.col(4) = (-15 * way + 7 * rate - bend) / (t * t * t * t);
  coefficient_.col(5) = (6 * way - 3 * rate + bend / 2) / (t * t * t * t * t);
}

BeamState Blend::at(double time_s) const {
  const double t = std::clamp(time_s, 0.0, duration_s_);
  const auto c = [this](int i) { return coefficient_.col(i); };
  BeamState out;
  out.place = c(0) + t * (c(1) + t * (c(2) + t * (c(3) + t * (c(4) + t * c(5)))));
  out.rate = c(1) + t * (2 * c(2) + t * (3 * c(3) + t * (4 * c(4) + t * 5 * c(5))));
  out.acceleration = 2 * c(2) + t * (6 * c(3) + t * (12 * c(4) + t * 20 * c(5)));
  return out;
}

Eigen::Vector3d Blend::jerk_at(double time_s) const {
  return 6 * coefficient_.col(3) + time_s * (24 * coefficient_.col(4) + time_s * 60 * coefficient_.col(5));
}

Curve::Curve(const std::vector<Vec2>& points) {
  WELDCELL_ASSERT(points.size() >= 2);
  for (const Vec2& p : points) {
    if (!points_.empty() && (p - points_.back()).norm() < 1e-9) continue;
    knots_.push_back(points_.empty() ? 0 : knots_.back() + (p - points_.back()).norm());
    points_.push_back(p);
  }
  if (points_.size() < 2) {
    points_.push_back(points_.back() + Vec2(1e-6, 0));
    knots_.push_back(1e-6);
  }
  const std::size_t n = points_.size();
  bends_.assign(n, Vec2::Zero());
  if (n < 4) return;
  // Not-a-knot ends keep the curvature of a spiral up to its first and last point; a natural spline would
  // flatten it.
  const auto h = [this](std::size_t i) { return knots_[i + 1] - knots_[i]; };
  const std::size_t m = n - 2;
  std::vector<double> below(m), diagonal(m), above(m);
  std::vector<Vec2> right(m);
  for (std::size_t i = 0; i < m; ++i) {
    below[i] = h(i), diagonal[i] = 2 * (h(i) + h(i + 1)), above[i] = h(i + 1);
    right[i] = 6 * ((points_[i + 2] - points_[i + 1]) / h(i + 1) - (points_[i + 1] - points_[i]) / h(i));
  }
  const double first = h(0) / h(1), last = h(n - 2) / h(n - 3);
  diagonal[0] += h(0) * (1 + first), above[0] -= h(0) * first;
  diagonal[m - 1] += h(n - 2) * (1 + last), below[m - 1] -= h(n - 2) * last;
  for (std::size_t i = 1; i < m; ++i) {
    const double w = below[i] / diagonal[i - 1];
    diagonal[i] -= w * above[i - 1];
    right[i] -= w * right[i - 1];
  }
  bends_[m] = right[m - 1] / diagonal[m - 1];
  for (std::size_t i = m - 1; i-- > 0;) bends_[i + 1] = (right[i] - above[i] * bends_[i + 2]) / diagonal[i];
  bends_[0] = (1 + first) * bends_[1] - first * bends_[2];
  bends_[n - 1] = (1 + last) * bends_[n - 2] - last * bends_[n - 3];
}

Curve::Local Curve::at(double s_mm) const {
  const double s = std::clamp(s_mm, 0.0, knots_.back());
  const auto after = std::upper_bound(knots_.begin() + 1, knots_.end() - 1, s);
  const auto i = static_cast<std::size_t>(after - knots_.begin()) - 1;
  const double h = knots_[i + 1] - knots_[i], b = (s - knots_[i]) / h, a = 1 - b;
  Local out;
  out.point = a * points_[i] + b * points_[i + 1] +
              h * h / 6 * ((a * a * a - a) * bends_[i] + (b * b * b - b) * bends_[i + 1]);
  out.tangent = (points_[i + 1] - points_[i]) / h +
                h / 6 * ((3 * b * b - 1) * bends_[i + 1] - (3 * a * a - 1) * bends_[i]);
  out.bend = a * bends_[i] + b * bends_[i + 1];
  return out;
}

SpeedProfile::SpeedProfile(double length_mm, const std::vector<double>& caps_mm_s, double smooth_mm) {
  WELDCELL_ASSERT(caps_mm_s.size() >= 2);
  const std::size_t n = caps_mm_s.size();
  step_mm_ = length_mm / static_cast<double>(n - 1);
  const auto window = static_cast<std::ptrdiff_t>(std::ceil(smooth_mm / step_mm_));
  const auto end = static_cast<std::ptrdiff_t>(n);
  // Lowest cap within the window, then a weighted mean within the same window: no value can rise above its
  // own cap.
  std::vector<double> lowest(n);
  for (std::ptrdiff_t i = 0; i < end; ++i) {
    const auto from = caps_mm_s.begin() + std::max<std::ptrdiff_t>(0, i - window);
    const auto to = caps_mm_s.begin() + std::min(end, i + window + 1);
    lowest[static_cast<std::size_t>(i)] = *std::min_element(from, to);
  }
  speeds_.resize(n);
  for (std::ptrdiff_t i = 0; i < end; ++i) {
    double sum = 0, weights = 0;
    for (std::ptrdiff_t k = -window; k <= window; ++k) {
      const double c = std::cos(kPi / 2 * static_cast<double>(k) / static_cast<double>(window + 1));
      const double weight = c * c * c * c;
      sum += weight * lowest[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(i + k, 0, end - 1))];
      weights += weight;
    }
    speeds_[static_cast<std::size_t>(i)] = sum / weights;
  }
  times_.assign(n, 0);
  for (std::size_t i = 1; i < n; ++i)
    times_[i] = times_[i - 1] + 2 * step_mm_ / (speeds_[i - 1] + speeds_[i]);
}

SpeedProfile::Along SpeedProfile::at(double time_s) const {
  const double t = std::clamp(time_s, 0.0, times_.back());
  const auto after = std::upper_bound(times_.begin() + 1, times_.end() - 1, t);
  const auto i = static_cast<std::size_t>(after - times_.begin()) - 1;
  // Constant acceleration inside each step: speeds and times of the table belong together exactly.
  const double acceleration = (speeds_[i + 1] - speeds_[i]) / (times_[i + 1] - times_[i]), dt = t - times_[i];
  return {step_mm_ * static_cast<double>(i) + dt * (speeds_[i] + acceleration * dt / 2),
          speeds_[i] + acceleration * dt, acceleration};
}

BeamState MeasuredPath::at(double time_s) const {
  const SpeedProfile::Along along = speed_.at(time_s);
  const Curve::Local c = curve_.at(along.s_mm);
  const double v = along.speed_mm_s;
  BeamState out;
  out.place = {c.point.x(), c.point.y(), receiver_rad_};
  out.rate.head<2>() = v * c.tangent;
  out.acceleration.head<2>() = v * v * c.bend + along.acceleration_mm_s2 * c.tangent;
  return out;
}

}  // namespace weldcell::plan
