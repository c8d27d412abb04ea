// Unwraps the devices' own clocks into 64-bit nanoseconds and finds where a clock was reset or stepped. Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "weldcell/align/aligner.hpp"

namespace weldcell::align {

/// What one message's clock says, relative to the message before.
struct DeviceStep {
  std::int64_t device_ns = 0;
  std::uint32_t lost = 0;  ///< messages missing just before this one
  bool restarted = false;  ///< the clock does not continue: a new mapping begins here
  bool stalled = false;  ///< the clock stands still while the count goes on, which carries the time meanwhile
};

/// Laser: 32-bit microsecond stamps, or the reading's number over the rate when the stream carries no stamp.
class LaserClock {
 public:
  /// Learns from the stream itself which clocks it carries and how long a period is; rate_hz is used without
  /// stamps.
  LaserClock(std::span<const StampedReading> readings, double rate_hz);
  /// nullopt: the reading repeats the one before and is left out.
  std::optional<DeviceStep> step(const wire::LaserReading& reading);
  void rewind() { first_ = true; }
  bool has_timestamp() const { return has_timestamp_; }

 private:
  bool has_timestamp_ = false, has_counter_ = false, first_ = true;
  double period_ns_ = 0;
  std::int64_t device_ns_ = 0;
  std::uint32_t last_timestamp_us_ = 0, last_counter_ = 0;
};

/// Robot: feedBack.time (microseconds) when every message has it, else tm, whose whole milliseconds are
/// smoothed with the sequence number. A step shows where clock and sequence number part, and clock and
/// arrival.
class RobotClock {
 public:
  explicit RobotClock(std::span<const StampedFeedback> poses);
  /// nullopt: the message repeats or precedes an earlier one and is left out.
  std::optional<DeviceStep> step(const StampedFeedback& pose);
  void rewind() { first_ = true; }
  /// How much older the measurement is than the sending of its frame: feedBack.time against tm, which run
  /// from one origin (EGM wire facts), half a millisecond at worst; 0 where the two do not go together.
  Nanoseconds send_age_ns() const { return send_age_ns_; }

 private:
  bool has_time_ = false, first_ = true;
  Nanoseconds send_age_ns_ = 0;
  double tm_zero_ns_ = 0, tm_period_ns_ = 0;  ///< 0: sequence and tm do not go together, tm is used as it is
  std::uint32_t seqno_zero_ = 0, tm_zero_ms_ = 0, seqno_ = 0;
  double period_ns_ = 0;  ///< of the sequence number by the clock; 0: they do not go together
  std::int64_t device_ns_ = 0, arrival_ns_ = 0;

  void find_period(std::span<const StampedFeedback> poses);
  std::int64_t raw_ns(const wire::EgmFeedback& feedback) const;
};

}  // namespace weldcell::align
