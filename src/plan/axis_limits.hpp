// The joint limits of a cell as plain numbers for planning and checking. Pure.
#pragma once

#include "weldcell/base/result.hpp"
#include "weldcell/cell/cell_setup.hpp"

namespace weldcell::plan {

struct AxisLimits {
  kinematics::Joints speed{}, acceleration{}, jerk{};  ///< rad/s, rad/s2, rad/s3
};

/// Error "plan.limits" when the cell leaves one at zero.
Result<AxisLimits> axis_limits(const cell::CellSetup& cell);

inline double period_of(const cell::CellSetup& cell) { return cell.egm.cycle_ms * 1e-3; }

}  // namespace weldcell::plan
