#include <fmt/format.h>

#include <cmath>

#include "axis_limits.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/plan/motion_plan.hpp"

namespace weldcell::plan {

namespace {

/// Rounding of sampled differences: a motion at its limit must not be refused for the last digit.
constexpr double kSlack = 1e-6;
constexpr double kRest_rad_s = 1e-6;
/// Largest disagreement between the step of q and the mean of qd over it.
constexpr double kStepMismatch_rad = 1e-5;

struct Worst {
  static constexpr double kNotANumber = 1e300;  ///< worse than any number
  double ratio = 1 + kSlack;
  Error error;

  void offer(double value, double limit, const char* code, const char* quantity, const char* unit,
             std::size_t axis, double time_s, const char* mend) {
    const double share = std::abs(value) / limit;
    if (ratio >= kNotANumber || !(share > ratio || std::isnan(share))) return;
    ratio = std::isnan(share) ? kNotANumber : share;
    error = {code, fmt::format("J{} at {:.3f} s", axis + 1, time_s),
             fmt::format("{} {:.2f} {} above the limit {:.2f}", quantity, deg(value), unit, deg(limit)),
             mend};
  }
};

constexpr const char* kSlower = "plan the motion slower or raise the cell's limit";

Status check_limits(const cell::CellSetup& cell, const MotionPlan& plan) {
  const double margin = cell.limits.limit_margin_rad;
  for (std::size_t k = 0; k < plan.samples.size(); ++k) {
    for (std::size_t i = 0; i < 6; ++i) {
      const double q = plan.samples[k].q[i];
      const double low = cell.arm.lower[i] + margin, high = cell.arm.upper[i] - margin;
      if (q >= low - 1e-9 && q <= high + 1e-9) continue;
      return Error{"plan.limit",
                   fmt::format("J{} at {:.3f} s", i + 1, plan.period_s * static_cast<double>(k)),
                   fmt::format("{:.2f} deg outside {:.2f}..{:.2f} deg", deg(q), deg(low), deg(high)),
                   "place the part elsewhere or choose another arm configuration"};
    }
  }
  return Done{};
}

Status check_rates(const AxisLimits& limits, const MotionPlan& plan) {
  const double h = plan.period_s;
  const std::size_t n = plan.samples.size();
  const auto velocity = [&plan, n](std::size_t k, std::size_t axis) {
    // Before the first and after the last sample the arm stands.
    return k == 0 || k > n ? 0.0 : plan.samples[k - 1].qd[axis];
  };
  Worst worst;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t k = 1; k <= n + 1; ++k) {
      const double time_s = h * static_cast<double>(k - 1);
      const double v = velocity(k, i), before = velocity(k - 1, i), after = k > n ? 0.0 : velocity(k + 1, i);
      worst.offer(v, limits.speed[i], "plan.speed", "speed", "deg/s", i, time_s, kSlower);
      worst.offer((v - before) / h, limits.acceleration[i], "plan.acceleration", "acceleration", "deg/s2", i,
                  time_s, kSlower);
      worst.offer((after - 2 * v + before) / (h * h), limits.jerk[i], "plan.jerk", "jerk", "deg/s3", i,
                  time_s, kSlower);
      if (k < 2 || k > n) continue;
      const double step = plan.samples[k - 1].q[i] - plan.samples[k - 2].q[i];
      worst.offer(step - h * (v + before) / 2, kStepMismatch_rad + h * h * h * limits.jerk[i] / 6,
                  "plan.consistency", "step against the stated velocity", "deg", i, time_s,
                  "q and qd must belong together");
    }
  }
  if (!worst.error.code.empty()) return worst.error;
  return Done{};
}

Status check_ends(const MotionPlan& plan) {
  for (const MotionSample* end : {&plan.samples.front(), &plan.samples.back()}) {
    for (std::size_t i = 0; i < 6; ++i) {
      if (std::abs(end->qd[i]) <= kRest_rad_s) continue;
      return Error{
          "plan.rest",
          fmt::format("J{} at {:.3f} s", i + 1, end == &plan.samples.front() ? 0 : plan.duration_s()),
          fmt::format("moves at {:.4f} deg/s, limit 0", deg(end->qd[i])), "begin and end the motion at rest"};
    }
  }
  return Done{};
}

/// Only while scanning: a joint move may pass the wrist's singularity, a straight beam path may not.
Status check_wrist(const cell::CellSetup& cell, const MotionPlan& plan) {
  if (plan.passes.empty()) return Done{};
  const double from_s = plan.passes.front().from_s, to_s = plan.passes.back().to_s;
  for (std::size_t k = 0; k < plan.samples.size(); ++k) {
    const double time_s = plan.period_s * static_cast<double>(k);
    const double s5 = std::abs(std::sin(plan.samples[k].q[4]));
    if (time_s < from_s || time_s > to_s || s5 >= cell.limits.min_sin_j5) continue;
    return Error{"plan.singularity", fmt::format("J5 at {:.3f} s", time_s),
                 fmt::format("|sin J5| {:.3f} below the limit {:.3f}", s5, cell.limits.min_sin_j5),
                 "place the part elsewhere"};
  }
  return Done{};
}

}  // namespace

Status preflight(const cell::CellSetup& cell, const MotionPlan& plan) {
  const Result<AxisLimits> limits = axis_limits(cell);
  if (!limits) return limits.error();
  if (plan.samples.empty() || !(plan.period_s > 0)) {
    return Error{"plan.empty", "", "the motion has no samples", "plan at least one path"};
  }
  for (const Status& status :
       {check_limits(cell, plan), check_ends(plan), check_rates(*limits, plan), check_wrist(cell, plan)}) {
    if (!status) return status.error();
  }
  return Done{};
}

}  // namespace weldcell::plan
