// A joint trajectory sampled on the controller's cycle, checked before anything moves. Pure.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "weldcell/base/result.hpp"
#include "weldcell/cell/cell_setup.hpp"

namespace weldcell::plan {

struct MotionSample {
  kinematics::Joints q{};   ///< rad
  kinematics::Joints qd{};  ///< rad/s
};

/// A stretch of a motion in which the laser's readings count.
struct ScanPass {
  std::string name;             ///< e.g. "rail_L zigzag 3"
  double from_s = 0, to_s = 0;  ///< of the plan's time
};

/// Starts and ends at rest. Sample k belongs to time k * period_s.
struct MotionPlan {
  std::uint64_t id = 0;
  double period_s = 0.004;
  std::vector<MotionSample> samples;
  std::vector<ScanPass> passes;
  double duration_s() const {
    return samples.empty() ? 0 : period_s * static_cast<double>(samples.size() - 1);
  }
};

/// Position and velocity at a time, cubic between samples, clamped to the plan's ends. Real-time safe.
MotionSample sample_at(const MotionPlan& plan, double time_s) noexcept;

/// Checks every sample: limits with margin, speed, acceleration, jerk, rest at both ends, |sin J5|.
/// The error names axis, time and limit ("plan.speed", "plan.limit", "plan.singularity", ...).
Status preflight(const cell::CellSetup& cell, const MotionPlan& plan);

/// Jerk-limited rest-to-rest joint move, all axes in step.
Result<MotionPlan> joint_move(const cell::CellSetup& cell, const kinematics::Joints& from,
                              const kinematics::Joints& to);

}  // namespace weldcell::plan
