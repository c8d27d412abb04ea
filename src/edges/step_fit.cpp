#include "step_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace weldcell::edges {
namespace {

using Vector = StepModel::Vector;
using Matrix = Eigen::Matrix<double, StepModel::kParameters, StepModel::kParameters>;

constexpr double kTukey = 6.0;         // residuals beyond this many sigmas do not count
constexpr double kShapeError = 0.012;  // of the height: what the spot's true light may differ from a Gaussian
constexpr double kBlurPrior = 0.4;     // 1 sigma of log(blur / expected)
constexpr double kSlopePrior = 0.05;
constexpr int kIterations = 14;
constexpr double kStart = 0.25;  // of the height: the first residual scale

double median_of(std::vector<double>& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// One fit with a given set of free parameters.
class Solver {
 public:
  Solver(const std::vector<Sample>& samples, const FitOptions& options, bool rounded, const StepModel& start)
      : samples_(samples), options_(options), rounded_(rounded), model_(start), noise_(options.noise_mm) {}

  StepFit run() {
    double widen = std::max(1.0, kStart * options_.height_mm / (kTukey * options_.noise_mm));
    for (int i = 0; i < kIterations; ++i) {
      assemble(widen);
      const bool small = update();
      if (widen > 1) {
        widen = std::max(1.0, 0.4 * widen);
      } else {
        measure_noise();
        if (small && i >= 4) break;
      }
    }
    assemble(1);
    return report();
  }

  double cost() const { return cost_; }

 private:
  double sample_sigma(const Sample& s) const {
    const double t = (s.u_mm - model_.position_mm) / model_.blur_mm;
    const double shape = std::abs(t) < 6 ? kShapeError * model_.height_mm() * std::exp(-0.25 * t * t) : 0;
    return std::sqrt(noise_ * noise_ / s.count + shape * shape);
  }

  void assemble(double widen) {
    normal_.setZero();
    right_.setZero();
    cost_ = 0;
    used_ = 0;
    chi2_ = 0;
    Vector g;
    for (const Sample& s : samples_) {
      const double residual = s.z_mm - model_.value(s.u_mm, &g);
      const double sigma = sample_sigma(s), scaled = residual / (sigma * widen * kTukey);
      if (std::abs(scaled) >= 1) {
        cost_ += kTukey * kTukey / 3;
        continue;
      }
      const double keep = 1 - scaled * scaled, root = keep * keep;
      const double weight = root / (sigma * sigma);
      cost_ += kTukey * kTukey / 3 * (1 - keep * keep * keep);
      normal_.noalias() += weight * g * g.transpose();
      right_.noalias() += weight * residual * g;
      used_ += s.count;
      chi2_ += residual * residual / (sigma * sigma);
      ++groups_used_;
    }
    const double log_blur = std::log(model_.blur_mm / options_.expected_blur_mm);
    normal_(StepModel::LogBlur, StepModel::LogBlur) += 1 / (kBlurPrior * kBlurPrior);
    right_[StepModel::LogBlur] -= log_blur / (kBlurPrior * kBlurPrior);
    normal_(StepModel::Slope, StepModel::Slope) += 1 / (kSlopePrior * kSlopePrior);
    right_[StepModel::Slope] -= model_.slope / (kSlopePrior * kSlopePrior);
    // The rounding's length is known to be near its depth where the crossing is square.
    if (rounded_) {
      normal_(StepModel::LogLength, StepModel::LogLength) += 4;
      right_[StepModel::LogLength] -= 4 * std::log(model_.length_mm / std::max(model_.depth_mm, 0.3));
    } else {
      for (const int p : {StepModel::Depth, StepModel::LogLength}) {
        normal_.row(p).setZero();
        normal_.col(p).setZero();
        normal_(p, p) = 1;
        right_[p] = 0;
      }
    }
    // Keeps a parameter that the samples do not see where it is.
    for (int p = 0; p < StepModel::kParameters; ++p) normal_(p, p) += 1e-6 * (normal_(p, p) + 1);
  }

  bool update() {
    const Vector step = normal_.ldlt().solve(right_);
    if (!step.allFinite()) return true;
    model_.position_mm += std::clamp(step[StepModel::Position], -0.4, 0.4);
    model_.low_mm += step[StepModel::Low];
    model_.high_mm += step[StepModel::High];
    model_.slope += std::clamp(step[StepModel::Slope], -0.1, 0.1);
    const double blur = model_.blur_mm * std::exp(std::clamp(step[StepModel::LogBlur], -0.5, 0.5));
    model_.blur_mm = std::clamp(blur, 0.15 * options_.expected_blur_mm, 6 * options_.expected_blur_mm);
    if (rounded_) {
      model_.depth_mm = std::clamp(model_.depth_mm + step[StepModel::Depth], 0.01, 0.7 * options_.height_mm);
      const double length = model_.length_mm * std::exp(std::clamp(step[StepModel::LogLength], -0.5, 0.5));
      model_.length_mm = std::clamp(length, 0.2, 20.0);
    }
    return std::abs(step[StepModel::Position]) < 2e-4;
  }

  void measure_noise() {
    spread_.clear();
    for (const Sample& s : samples_) {
      if (std::abs(s.u_mm - model_.position_mm) < 2 * model_.blur_mm) continue;
      spread_.push_back(std::abs(s.z_mm - model_.value(s.u_mm, nullptr)) *
                        std::sqrt(static_cast<double>(s.count)));
    }
    if (spread_.size() < 12) return;
    noise_ = std::clamp(1.4826 * median_of(spread_), 0.3 * options_.noise_mm, 3 * options_.noise_mm);
  }

  /// Factor on the variance for noise that neighbouring readings share (speckle bound to the surface).
  double correlation_factor() const {
    double both = 0, self = 0, last = 0;
    bool has_last = false;
    for (const Sample& s : samples_) {
      const double r = s.z_mm - model_.value(s.u_mm, nullptr);
      const bool plateau = std::abs(s.u_mm - model_.position_mm) > 2 * model_.blur_mm;
      if (!plateau || std::abs(r) > 4 * noise_) {
        has_last = false;
        continue;
      }
      if (has_last) {
        both += r * last;
        self += 0.5 * (r * r + last * last);
      }
      last = r;
      has_last = true;
    }
    const double lag = self > 0 ? std::clamp(both / self, 0.0, 0.9) : 0.0;
    return lag > 0.15 ? (1 + lag) / (1 - lag) : 1.0;
  }

  StepFit report() {
    StepFit fit;
    fit.model = model_;
    fit.noise_mm = noise_;
    int total = 0;
    double before = -1e9, after = 1e9;
    for (const Sample& s : samples_) {
      total += s.count;
      if (s.u_mm <= model_.position_mm) before = std::max(before, s.u_mm);
      if (s.u_mm > model_.position_mm) after = std::min(after, s.u_mm);
    }
    fit.outliers = total > 0 ? 1 - static_cast<double>(used_) / total : 1;
    fit.bracket_mm = after - before;
    int groups = 0;
    Vector unused;
    chi2_ = 0;
    for (const Sample& s : samples_) {
      const double scaled = (s.z_mm - model_.value(s.u_mm, nullptr)) / sample_sigma(s);
      if (std::abs(scaled) >= kTukey) continue;
      chi2_ += scaled * scaled;
      ++groups;
    }
    const int free = rounded_ ? 7 : 5;
    fit.chi2 = groups > free ? chi2_ / (groups - free) : 0;
    const Matrix covariance = normal_.ldlt().solve(Matrix::Identity());
    const double variance = covariance(StepModel::Position, StepModel::Position) * correlation_factor();
    fit.usable = std::isfinite(variance) && variance > 0 && std::isfinite(model_.position_mm) &&
                 before > -1e8 && after < 1e8;
    if (!fit.usable) return fit;
    fit.sigma_mm = std::sqrt(variance);
    const double jump_sigma = fit.bracket_mm / std::sqrt(12.0);
    if (model_.blur_mm < 0.3 * fit.bracket_mm) {
      // The step fell between two readings: it is anywhere in between.
      fit.model.position_mm = 0.5 * (before + after);
      fit.sigma_mm = jump_sigma;
    }
    return fit;
  }

  const std::vector<Sample>& samples_;
  const FitOptions& options_;
  bool rounded_;
  StepModel model_;
  double noise_;
  Matrix normal_;
  Vector right_;
  double cost_ = 0, chi2_ = 0;
  int used_ = 0, groups_used_ = 0;
  std::vector<double> spread_;
};

double median_between(const std::vector<Sample>& samples, double from, double to, std::size_t& seen) {
  std::vector<double> values;
  for (const Sample& s : samples) {
    if (s.u_mm >= from && s.u_mm <= to) values.push_back(s.z_mm);
  }
  seen = values.size();
  return median_of(values);
}

}  // namespace

StepFit fit_step(const std::vector<Sample>& samples, const FitOptions& options) {
  std::size_t low_seen = 0, high_seen = 0, near_seen = 0;
  StepModel start;
  start.blur_mm = options.expected_blur_mm;
  const double reach = 1.5 * options.expected_blur_mm;
  start.low_mm = median_between(samples, -1e9, -reach, low_seen);
  const double span = samples.empty() ? 0 : samples.back().u_mm;
  start.high_mm = median_between(samples, std::min(reach, 0.4 * span), 1e9, high_seen);
  if (low_seen < 2 || high_seen < 2) return {};

  Solver sharp(samples, options, false, start);
  StepFit best = sharp.run();
  // A round corner shows as readings just inside the step that lie below those farther in.
  const double far_mm = median_between(samples, 0.5 * span, span, high_seen);
  const double near_mm = median_between(samples, 0.7, std::min(1.8, 0.4 * span), near_seen);
  const double sag = far_mm - near_mm;
  const double noise_of_medians =
      options.noise_mm * std::sqrt(1.6 / static_cast<double>(std::max<std::size_t>(1, near_seen)));
  if (span > 1.5 && near_seen >= 2 && sag > std::max(4 * noise_of_medians, 0.006 * options.height_mm)) {
    StepModel round = start;
    round.high_mm = far_mm;
    // Sag s at 1.25 mm inside a quarter circle of radius r: solved for r by two steps of a fixed-point
    // iteration.
    double radius = 2.0;
    for (int i = 0; i < 20; ++i) {
      const double inside = std::min(1.25, radius);
      const double seen = radius - std::sqrt(inside * (2 * radius - inside));
      radius = std::clamp(radius * (1 + 0.5 * (sag - seen) / std::max(sag, seen)), 0.5, 12.0);
    }
    round.depth_mm = std::min(radius, 0.6 * options.height_mm);
    round.length_mm = radius;
    Solver rounded(samples, options, true, round);
    const StepFit other = rounded.run();
    if (other.usable && (!best.usable || rounded.cost() + 10 < sharp.cost())) best = other;
  }
  return best;
}

}  // namespace weldcell::edges
