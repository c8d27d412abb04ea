#include "weldcell/plan/motion_plan.hpp"

#include <algorithm>
#include <cmath>

#include "axis_limits.hpp"
#include "weldcell/plan/double_s.hpp"

namespace weldcell::plan {

MotionSample sample_at(const MotionPlan& plan, double time_s) noexcept {
  if (plan.samples.empty()) return {};
  const double last = static_cast<double>(plan.samples.size() - 1);
  const double place = time_s / plan.period_s;
  if (!(place > 0)) return plan.samples.front();
  if (place >= last) return plan.samples.back();
  const auto k = static_cast<std::size_t>(place);
  const double u = place - static_cast<double>(k), h = plan.period_s;
  const MotionSample& a = plan.samples[k];
  const MotionSample& b = plan.samples[k + 1];
  MotionSample out;
  for (std::size_t i = 0; i < 6; ++i) {
    const double rise = b.q[i] - a.q[i], m0 = h * a.qd[i], m1 = h * b.qd[i];
    const double c2 = 3 * rise - 2 * m0 - m1, c3 = m0 + m1 - 2 * rise;
    out.q[i] = a.q[i] + u * (m0 + u * (c2 + u * c3));
    out.qd[i] = (m0 + u * (2 * c2 + u * 3 * c3)) / h;
  }
  return out;
}

Result<MotionPlan> joint_move(const cell::CellSetup& cell, const kinematics::Joints& from,
                              const kinematics::Joints& to) {
  const Result<AxisLimits> limits = axis_limits(cell);
  if (!limits) return limits.error();
  MotionPlan plan;
  plan.period_s = period_of(cell);
  double speed = 1e300, acceleration = 1e300, jerk = 1e300;
  bool moves = false;
  for (std::size_t i = 0; i < 6; ++i) {
    const double way = std::abs(to[i] - from[i]);
    if (!(way > 1e-12)) continue;
    moves = true;
    speed = std::min(speed, limits->speed[i] / way);
    acceleration = std::min(acceleration, limits->acceleration[i] / way);
    jerk = std::min(jerk, limits->jerk[i] / way);
  }
  // All axes share one profile of the way done, 0..1, so that they start and arrive together.
  const DoubleS profile = moves ? double_s(1, speed, acceleration, jerk) : DoubleS{};
  const auto count = static_cast<std::size_t>(std::ceil(profile.duration_s() / plan.period_s)) + 1;
  plan.samples.resize(count);
  for (std::size_t k = 0; k < count; ++k) {
    const ProfilePoint p = profile.at(plan.period_s * static_cast<double>(k));
    for (std::size_t i = 0; i < 6; ++i) {
      plan.samples[k].q[i] = from[i] + p.position * (to[i] - from[i]);
      plan.samples[k].qd[i] = p.speed * (to[i] - from[i]);
    }
  }
  plan.samples.back() = {to, {}};
  const Status checked = preflight(cell, plan);
  if (!checked) return checked.error();
  return plan;
}

}  // namespace weldcell::plan
