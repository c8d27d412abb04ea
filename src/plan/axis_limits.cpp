#include "axis_limits.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace weldcell::plan {

Result<AxisLimits> axis_limits(const cell::CellSetup& cell) {
  AxisLimits out;
  for (std::size_t i = 0; i < 6; ++i) {
    out.speed[i] = cell.arm.max_speed[i] * cell.limits.joint_speed_fraction;
    out.acceleration[i] = cell.limits.joint_acceleration[i];
    out.jerk[i] = cell.limits.joint_jerk[i];
    // A change of acceleration that lasts a whole period of the arm's lowest oscillation does not excite it.
    if (cell.limits.natural_frequency_hz > 0)
      out.jerk[i] = std::min(out.jerk[i], out.acceleration[i] * cell.limits.natural_frequency_hz);
    if (!(out.speed[i] > 0 && out.acceleration[i] > 0 && out.jerk[i] > 0)) {
      return Error{"plan.limits", cell.name,
                   fmt::format("J{} has no speed, acceleration or jerk to plan with", i + 1),
                   "state positive limits in the cell file and speeds in the arm file"};
    }
  }
  if (!(cell.egm.cycle_ms > 0))
    return Error{"plan.limits", cell.name, "egm.cycle_ms is not positive", "write 4"};
  return out;
}

}  // namespace weldcell::plan
