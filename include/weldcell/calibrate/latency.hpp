// The laser's constant latency from passes to and fro over straight edges at several speeds. Pure.
//
// A reading that is stamped tau too late is placed too far along its travel: a crossing of an edge that lies
// at x0 is seen at x0 + direction * (speed * tau + b). b is what shifts a crossing along the travel whatever
// the speed: the sensor's own hysteresis, a one-sided rounding, the detector's bias. Both directions tell x0
// from the rest, several speeds tell tau from b. With one speed the two look the same; then there is no
// answer, and fit_latency says so.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "weldcell/base/result.hpp"

namespace weldcell::calibrate {

/// One crossing of a straight edge.
struct GaugeCrossing {
  int edge = 0;          ///< which straight edge; each has its own place and slope
  double across_mm = 0;  ///< place seen, along the edge's normal
  double along_mm = 0;   ///< place along the edge; 0 everywhere when it is not known
  double direction = 1;  ///< cosine between travel and normal, -1..1; its sign is the direction of the pass
  double speed_mm_s = 0;
  double sigma_mm = 0;  ///< 1 sigma of across_mm; 0 = unknown, all alike
};

struct LatencyOptions {
  int min_crossings = 6;         ///< with two more a pass of each direction is left to judge the scatter
  int min_speeds = 3;            ///< two only draw a line through b and tau: a third shows whether it holds
  double speed_step = 0.10;      ///< speeds closer than this share are one
  double min_speed_ratio = 1.5;  ///< fastest over slowest
  double max_sigma_ms = 0.1;     ///< a latency less certain than this is no calibration (0.05 mm at 500 mm/s)
  double max_rejected_share = 0.25;
  double default_sigma_mm = 0.03;
};

struct LatencyFit {
  double latency_ms = 0;  ///< to be added to the latency that placed the crossings
  double bias_mm = 0;     ///< b
  /// Of (latency ms, bias mm), scaled up where the crossings scatter more than they state.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  std::vector<double> edge_mm;      ///< place of each edge along its normal, at along = 0
  std::vector<int> edge_ids;        ///< GaugeCrossing::edge of each
  std::vector<double> residual_mm;  ///< one a crossing: seen minus fitted
  std::vector<char> used;           ///< 0: an outlier, weight zero
  double scatter = 1;               ///< robust sigma of residual / stated sigma
  double condition = 0;             ///< of the (latency, bias) covariance, columns scaled to 1
  std::vector<double> speeds_mm_s;  ///< mean of each cluster
  int forward = 0, backward = 0, rejected = 0;

  double sigma_ms() const;
  double bias_sigma_mm() const;
  double correlation() const;
};

/// Robust least squares (Tukey weights). Errors: "calibrate.latency" with the reason in words when the data
/// cannot tell latency from bias (too few crossings, one direction, one speed, speeds too near to each other)
/// or the answer is less certain than max_sigma_ms. Deterministic.
Result<LatencyFit> fit_latency(std::span<const GaugeCrossing> crossings, const LatencyOptions& options = {});

}  // namespace weldcell::calibrate
