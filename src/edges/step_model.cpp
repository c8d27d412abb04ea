#include "step_model.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace weldcell::edges {
namespace {

constexpr int kNodes = 7;  // on either side, half a sigma apart
constexpr double kSpacing = 0.5;
constexpr double kFar = 4.5;  // sigmas beyond which the spot no longer blurs

double density(double t) {
  return std::exp(-0.5 * t * t) * (0.5 * std::numbers::inv_sqrtpi * std::numbers::sqrt2);
}

const std::array<double, 2 * kNodes + 1>& node_weights() {
  static const auto weights = [] {
    std::array<double, 2 * kNodes + 1> w{};
    double sum = 0;
    for (int j = -kNodes; j <= kNodes; ++j)
      sum += w[static_cast<std::size_t>(j + kNodes)] = density(j * kSpacing);
    for (double& x : w) x /= sum;
    return w;
  }();
  return weights;
}

double corner(double share) {
  if (share <= 0) return 0;
  if (share >= 1) return 1;
  return std::sqrt(share * (2 - share));
}

/// The rounding's rise from 0 to 1, blurred, with its derivatives by t, log blur and log length.
struct Rise {
  double value = 0, by_t = 0, by_log_blur = 0, by_log_length = 0;
};

Rise rise(double t, double blur, double length) {
  Rise out;
  if (t < -kFar * blur) return out;
  if (t > kFar * blur) {
    const double share = t / length;
    out.value = corner(share);
    if (share < 1) {
      out.by_t = (1 - share) / (out.value * length);
      out.by_log_length = -t * out.by_t;
    }
    return out;
  }
  const auto& weights = node_weights();
  for (int j = -kNodes; j <= kNodes; ++j) {
    const double y = j * kSpacing;
    const double q = weights[static_cast<std::size_t>(j + kNodes)] * corner((t - y * blur) / length);
    out.value += q;
    out.by_t -= q * y / blur;
    out.by_log_blur += q * (y * y - 1);
  }
  // value depends on ratios of the three lengths only.
  out.by_log_length = -t * out.by_t - out.by_log_blur;
  return out;
}

}  // namespace

double StepModel::value(double u, Vector* gradient) const {
  const double t = u - position_mm, scaled = t / blur_mm;
  const double phi = 0.5 * std::erfc(-scaled * (1 / std::numbers::sqrt2));
  const double jump = high_mm - depth_mm - low_mm;
  const Rise r = depth_mm > 0 ? rise(t, blur_mm, length_mm) : Rise{};
  if (gradient != nullptr) {
    const double bell = std::abs(scaled) < 8 ? density(scaled) : 0;
    auto& g = *gradient;
    g[Position] = -(jump * bell / blur_mm + depth_mm * r.by_t);
    g[Low] = 1 - phi;
    g[High] = phi;
    g[Slope] = u;
    g[LogBlur] = -jump * scaled * bell + depth_mm * r.by_log_blur;
    g[Depth] = r.value - phi;
    g[LogLength] = depth_mm * r.by_log_length;
  }
  return low_mm + slope * u + jump * phi + depth_mm * r.value;
}

}  // namespace weldcell::edges
