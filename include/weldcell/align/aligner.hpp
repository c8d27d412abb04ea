// Robot poses and laser readings, each on its own clock, become surface points in frame Base. Pure,
// allocation-bounded.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "weldcell/base/time.hpp"
#include "weldcell/cell/cell_setup.hpp"
#include "weldcell/wire/egm.hpp"
#include "weldcell/wire/laser.hpp"

namespace weldcell::align {

/// One laser reading placed in Base. When code != 0, z is undefined and x, y are where the beam would have
/// met the plane of the last valid height, so that a drop-out keeps its place.
struct SurfacePoint {
  HostTime time;  ///< mid-exposure, host clock
  float x_mm = 0, y_mm = 0, z_mm = 0;
  float vx_mm_s = 0, vy_mm_s = 0;        ///< velocity of the beam's foot over the table
  float receiver_x = 0, receiver_y = 0;  ///< unit direction in the plane from the beam towards the receiver
  std::uint32_t code = 0;                ///< the sensor's error word; 0 = valid
  std::uint16_t gap = 0;                 ///< readings lost just before this one
};

/// What the alignment did, for the report and for alarms.
struct AlignSummary {
  std::uint64_t points = 0, invalid = 0, lost = 0, without_pose = 0;
  std::uint64_t clock_resets =
      0;  ///< times that a clock began anew or was stepped: a mapping of its own from there on
  std::uint64_t clock_stalls =
      0;                       ///< times that the laser's clock stood still: placed by the count meanwhile
  std::uint64_t repeated = 0;  ///< readings and poses that came twice, or with an older clock, left out
  double laser_skew_ppm = 0, robot_skew_ppm = 0;
  double laser_rate_hz = 0;  ///< by running number and arrival over the whole scan; 0 = not known
  double laser_clock_sigma_us = 0,
         robot_clock_sigma_us = 0;  ///< stated 1-sigma of the mapping, constant excluded
};

/// A recorded block of laser bytes or EGM feedback with its arrival on the host.
struct StampedReading {
  HostTime arrival;
  wire::LaserReading reading;
};
struct StampedFeedback {
  HostTime arrival;
  wire::EgmFeedback feedback;
};

/// Aligns a whole scan at once (what the solver does): device clocks to host clock by lower envelope with
/// bounded skew, the laser's constant latency from the set-up subtracted, poses interpolated on the robot's
/// clock. Both clocks map onto the host through their own least transport delay, which one-way traffic cannot
/// show; the difference of the two is part of the latency that the localizer or a gauge scan finds. Readings
/// without an enclosing pose are left out and counted in without_pose; the next point's gap tells of them.
/// Readings and poses must be in the order in which they were received.
std::vector<SurfacePoint> align(const cell::CellSetup& cell, std::span<const StampedReading> readings,
                                std::span<const StampedFeedback> poses, AlignSummary& summary);

}  // namespace weldcell::align
