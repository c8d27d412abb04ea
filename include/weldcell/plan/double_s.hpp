// The double-S profile: time-optimal rest-to-rest travel under speed, acceleration and jerk limits. Pure,
// real-time safe.
#pragma once

namespace weldcell::plan {

struct ProfilePoint {
  double position = 0, speed = 0, acceleration = 0, jerk = 0;
};

/// Seven phases in closed form (Biagiotti, Melchiorri, Trajectory Planning for Automatic Machines, 3.4): jerk
/// for jerk_s, constant acceleration until ramp_s, cruise for cruise_s, and the same backwards.
struct DoubleS {
  double length = 0;
  double jerk = 0;
  double jerk_s = 0, ramp_s = 0, cruise_s = 0;

  double duration_s() const { return 2 * ramp_s + cruise_s; }
  double peak_acceleration() const { return jerk * jerk_s; }
  double peak_speed() const { return peak_acceleration() * (ramp_s - jerk_s); }
  /// Clamped to rest at both ends.
  ProfilePoint at(double time_s) const;
};

/// length >= 0, limits > 0, all in units of one length. A zero length takes no time.
DoubleS double_s(double length, double speed_limit, double acceleration_limit, double jerk_limit);

}  // namespace weldcell::plan
