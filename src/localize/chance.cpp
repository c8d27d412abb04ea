#include "chance.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "weldcell/base/units.hpp"

namespace weldcell::localize {

namespace {

/// Beyond so many sigmas there is nothing.
constexpr double kSigmas = 7;
constexpr int kSteps = 48;  ///< of Simpson's rule, even

/// Probability of a standard normal above x.
double upper_tail(double x) { return 0.5 * std::erfc(x * std::sqrt(0.5)); }

double outside(double mean, double sigma, double most) {
  return upper_tail((most - mean) / sigma) + upper_tail((most + mean) / sigma);
}

/// Probability that a plane Gaussian lies outside the circle: the chords of the circle across the longer
/// axis, summed along it.
double outside_circle(const Vec2& mean, const Eigen::Matrix2d& covariance, double radius) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(covariance);
  const double across = std::sqrt(std::max(axes.eigenvalues()(0), 1e-12)),
               along = std::sqrt(std::max(axes.eigenvalues()(1), 1e-12));
  if (mean.norm() + kSigmas * along < radius) return 0;
  const Vec2 centre = axes.eigenvectors().transpose() * mean;
  const double from = std::max(-radius, centre.y() - kSigmas * along),
               to = std::min(radius, centre.y() + kSigmas * along);
  if (from >= to) return 1;
  const double step = (to - from) / kSteps;
  double inside = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const double at = from + i * step, z = (at - centre.y()) / along;
    const double half = std::sqrt(std::max(0.0, radius * radius - at * at));
    const double density = std::exp(-0.5 * z * z) * (1 - outside(centre.x(), across, half));
    inside += density * (i == 0 || i == kSteps ? 1 : (i % 2 == 1 ? 4 : 2));
  }
  inside *= step / 3 / (along * std::sqrt(2 * kPi));
  return std::clamp(1 - inside, 0.0, 1.0);
}

}  // namespace

double chance_beyond(const std::vector<Chance>& chances, double most_mm, double most_rad) {
  if (chances.empty()) return 1;
  double out = 0;
  for (const Chance& c : chances) {
    const double shift = outside_circle(c.offset.head<2>(), c.covariance.topLeftCorner<2, 2>(), most_mm);
    const double turn = outside(c.offset(2), std::sqrt(std::max(c.covariance(2, 2), 1e-18)), most_rad);
    out += c.share * (shift + turn - shift * turn);
  }
  return std::clamp(out, 0.0, 1.0);
}

}  // namespace weldcell::localize
