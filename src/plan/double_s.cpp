#include "weldcell/plan/double_s.hpp"

#include <cmath>

#include "weldcell/base/assert.hpp"

namespace weldcell::plan {

DoubleS double_s(double length, double speed_limit, double acceleration_limit, double jerk_limit) {
  WELDCELL_ASSERT(length >= 0 && speed_limit > 0 && acceleration_limit > 0 && jerk_limit > 0);
  DoubleS out;
  out.length = length;
  out.jerk = jerk_limit;
  const double full_jerk_s = acceleration_limit / jerk_limit;
  if (speed_limit * jerk_limit >= acceleration_limit * acceleration_limit) {
    out.jerk_s = full_jerk_s;
    out.ramp_s = full_jerk_s + speed_limit / acceleration_limit;
  } else {
    out.jerk_s = std::sqrt(speed_limit / jerk_limit);
    out.ramp_s = 2 * out.jerk_s;
  }
  out.cruise_s = length / speed_limit - out.ramp_s;
  if (out.cruise_s >= 0) return out;
  out.cruise_s = 0;
  if (length >= 2 * acceleration_limit * full_jerk_s * full_jerk_s) {
    out.jerk_s = full_jerk_s;
    out.ramp_s = full_jerk_s / 2 + std::sqrt(full_jerk_s * full_jerk_s / 4 + length / acceleration_limit);
  } else {
    out.jerk_s = std::cbrt(length / (2 * jerk_limit));
    out.ramp_s = 2 * out.jerk_s;
  }
  return out;
}

namespace {

/// The ramp from rest to cruise at time t of it.
ProfilePoint ramp(const DoubleS& s, double t) {
  const double a = s.peak_acceleration();
  if (t < s.jerk_s) return {s.jerk * t * t * t / 6, s.jerk * t * t / 2, s.jerk * t, s.jerk};
  if (t < s.ramp_s - s.jerk_s) {
    const double position = a / 6 * (3 * t * t - 3 * s.jerk_s * t + s.jerk_s * s.jerk_s);
    return {position, a * (t - s.jerk_s / 2), a, 0};
  }
  const double left = s.ramp_s - t, v = s.peak_speed();
  return {v * s.ramp_s / 2 - v * left + s.jerk * left * left * left / 6, v - s.jerk * left * left / 2,
          s.jerk * left, -s.jerk};
}

}  // namespace

ProfilePoint DoubleS::at(double time_s) const {
  if (!(time_s > 0)) return {};
  if (time_s >= duration_s()) return {length, 0, 0, 0};
  if (time_s < ramp_s) return ramp(*this, time_s);
  if (time_s < ramp_s + cruise_s) {
    return {peak_speed() * (time_s - ramp_s / 2), peak_speed(), 0, 0};
  }
  const ProfilePoint mirrored = ramp(*this, duration_s() - time_s);
  return {length - mirrored.position, mirrored.speed, -mirrored.acceleration, mirrored.jerk};
}

}  // namespace weldcell::plan
