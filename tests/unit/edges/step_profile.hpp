// A bar on a table seen by a triangulation sensor, written for the tests alone: it shares nothing with the
// detector.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "weldcell/align/aligner.hpp"
#include "weldcell/geometry/plane.hpp"

namespace weldcell::edges {

struct StepProfile {
  double height_mm = 40,
         radius_mm = 0;  ///< bar from 0 to width along its normal, corners rounded with radius
  double width_mm = 40, margin_mm = 20;  ///< table before and after
  double speed_mm_s = 200, rate_hz = 5000, exposure_s = 0;
  double spot_mm = 1.1, noise_mm = 0.1;
  double outliers = 0, outlier_mm = 20;
  double correlation = 0;  ///< AR(1) of the noise from reading to reading
  bool peak = false;       ///< the sensor reads the brighter of two images; else their mean
  int receiver = 0;        ///< along the travel: +1 ahead, -1 behind, 0 across
  double turned_rad = 0;   ///< the bar's normal against the travel: it is crossed obliquely
  double triangulation_rad = 0.3, threshold = 0.06;
  bool backward = false;  ///< travels towards -x
  double phase = 0;       ///< first reading's place, share of the spacing
};

inline double bar_height(const StepProfile& p, double x) {
  const double inside = std::min(x, p.width_mm - x);
  if (inside < 0) return 0;
  if (inside >= p.radius_mm) return p.height_mm;
  const double d = p.radius_mm - inside;
  return p.height_mm - p.radius_mm + std::sqrt(p.radius_mm * p.radius_mm - d * d);
}

/// The bar's two sides as they lie across the travel, material to the left.
inline std::vector<Segment> bar_outline(const StepProfile& p) {
  const Vec2 normal(std::cos(p.turned_rad), std::sin(p.turned_rad)), along(-normal.y(), normal.x());
  const Vec2 far = p.width_mm * normal;
  return {{100 * along, -100 * along}, {far - 100 * along, far + 100 * along}};
}

/// Whether the receiver, towards direction `toward` in x, sees the surface point at x.
inline bool seen(const StepProfile& p, double x, double toward) {
  const double z = bar_height(p, x), slope = std::tan(p.triangulation_rad) * std::abs(toward);
  const double reach = (p.height_mm - z) * slope + 0.04;
  for (double d = 0.02; d < reach; d += 0.02) {
    if (bar_height(p, x + (toward > 0 ? d : -d)) > z + d / slope + 1e-9) return false;
  }
  return true;
}

/// Component of the receiver's direction along the bar's normal.
inline double receiver_across(const StepProfile& p) {
  if (p.receiver == 0) return std::abs(p.turned_rad) < 1e-9 ? 0 : std::sin(p.turned_rad);
  return (p.backward ? -p.receiver : p.receiver) * std::cos(p.turned_rad);
}

/// One reading without noise at distance x along the bar's normal; false = error code.
inline bool read_bar(const StepProfile& p, double x, double& z) {
  constexpr int kNodes = 121;
  const double blur = p.spot_mm / 4, receiver = receiver_across(p);
  const double nearest = std::min(std::abs(x), std::abs(x - p.width_mm));
  const double shadow = receiver != 0 ? p.height_mm * std::tan(p.triangulation_rad) : 0;
  if (nearest > 4.5 * blur + std::max(p.radius_mm, shadow) + 0.1) {
    z = bar_height(p, x);
    return true;
  }
  double total = 0, light[2] = {0, 0}, sum[2] = {0, 0};
  for (int j = 0; j < kNodes; ++j) {
    const double t = -4 + 8.0 * j / (kNodes - 1), weight = std::exp(-0.5 * t * t), dx = t * blur;
    total += weight;
    if (receiver != 0 && !seen(p, x + dx, receiver)) continue;
    const double height = bar_height(p, x + dx);
    const int image = p.peak && height > 0.5 * p.height_mm ? 1 : 0;
    light[image] += weight;
    sum[image] += weight * (height + receiver * dx / std::tan(p.triangulation_rad));
  }
  const int image = light[1] > light[0] ? 1 : 0;
  if (light[image] < p.threshold * total) return false;
  z = sum[image] / light[image];
  return true;
}

inline std::vector<align::SurfacePoint> scan_bar(const StepProfile& p, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  std::vector<align::SurfacePoint> out;
  const double dx = p.speed_mm_s / p.rate_hz, across = p.width_mm / std::cos(p.turned_rad);
  const double length = across + 2 * p.margin_mm;
  const auto count = static_cast<std::size_t>(length / dx);
  double noise = normal(random);
  for (std::size_t i = 0; i < count; ++i) {
    const double travelled = (static_cast<double>(i) + p.phase) * dx;
    const double x = p.backward ? across + p.margin_mm - travelled : travelled - p.margin_mm;
    double z = 0;
    bool ok = true;
    const int parts = p.exposure_s > 0 ? 5 : 1;
    for (int e = 0; e < parts; ++e) {
      double part = 0;
      const double moved = x + p.speed_mm_s * p.exposure_s * ((e + 0.5) / parts - 0.5);
      ok = ok && read_bar(p, moved * std::cos(p.turned_rad), part);
      z += part / parts;
    }
    noise = p.correlation * noise + std::sqrt(1 - p.correlation * p.correlation) * normal(random);
    z += p.noise_mm * noise;
    if (p.outliers > 0 && uniform(random) < p.outliers) z += p.outlier_mm * (2 * uniform(random) - 1);
    align::SurfacePoint point;
    point.time = HostTime{1'000'000'000 +
                          static_cast<Nanoseconds>(std::llround(1e9 * static_cast<double>(i) / p.rate_hz))};
    point.x_mm = static_cast<float>(x);
    point.z_mm = static_cast<float>(500 + z);
    point.vx_mm_s = static_cast<float>(p.backward ? -p.speed_mm_s : p.speed_mm_s);
    point.receiver_x = static_cast<float>(p.receiver == 0 ? 0 : (p.backward ? -p.receiver : p.receiver));
    point.receiver_y = p.receiver == 0 ? 1.0F : 0.0F;
    point.code = ok ? 0 : 0x7FFFFFFBU;
    out.push_back(point);
  }
  return out;
}

}  // namespace weldcell::edges
