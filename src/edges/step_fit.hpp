// Robust fit of the step model to the readings around one candidate, with position, sigma and chi2. Pure.
#pragma once

#include <vector>

#include "step_model.hpp"

namespace weldcell::edges {

/// Readings averaged over a small fraction of the spot; u towards the upper side.
struct Sample {
  double u_mm = 0, z_mm = 0;
  int count = 0;
};

struct FitOptions {
  double noise_mm = 0.1;
  double expected_blur_mm = 0.275;
  double height_mm = 0;
};

struct StepFit {
  bool usable = false;
  StepModel model;
  double sigma_mm = 0;    ///< of the position, from the noise alone
  double noise_mm = 0;    ///< of one reading, as the plateaus show it
  double chi2 = 0;        ///< per degree of freedom, outliers left out
  double outliers = 0;    ///< share of the readings that the fit does not explain
  double bracket_mm = 0;  ///< between the samples just before and just after the position
};

/// Samples must be sorted by u and start-position 0 be within about 1 mm of the step. Deterministic, no
/// allocation but for the weights.
StepFit fit_step(const std::vector<Sample>& samples, const FitOptions& options);

}  // namespace weldcell::edges
