#include "device_time.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace weldcell::align {
namespace {

constexpr std::size_t kPeriodSample = 1001;
constexpr double kStepToleranceNs = 2e6;  // stamps and numbers that part by more than this: one was stepped
constexpr double kStepToleranceShare = 0.01;
constexpr Nanoseconds kReorder = 100 * kMillisecond;
constexpr Nanoseconds kRobotStep = kSecond;
// Less could be the controller's own jitter between measuring and sending.
constexpr double kRobotStepToleranceNs = 6e6;

std::int32_t difference(std::uint32_t later, std::uint32_t earlier) {
  return static_cast<std::int32_t>(later - earlier);
}

}  // namespace

LaserClock::LaserClock(std::span<const StampedReading> readings, double rate_hz) : period_ns_(1e9 / rate_hz) {
  std::vector<double> periods;
  for (std::size_t i = 0; i < readings.size() && i < kPeriodSample; ++i) {
    has_timestamp_ |= readings[i].reading.timestamp_us != 0;
    if (i == 0) continue;
    const auto& a = readings[i - 1].reading;
    const auto& b = readings[i].reading;
    const std::int32_t numbers = difference(b.counter, a.counter);
    has_counter_ |= numbers != 0;
    const std::int32_t stamps = difference(b.timestamp_us, a.timestamp_us);
    if (numbers > 0 && stamps > 0) periods.push_back(1e3 * stamps / numbers);
  }
  if (has_timestamp_ && !periods.empty()) {
    // The mean of the middle half: a median alone would keep the stamps' whole microseconds.
    std::sort(periods.begin(), periods.end());
    const std::size_t from = periods.size() / 4, to = periods.size() - from;
    double sum = 0;
    for (std::size_t i = from; i < to; ++i) sum += periods[i];
    period_ns_ = sum / static_cast<double>(to - from);
  }
}

std::optional<DeviceStep> LaserClock::step(const wire::LaserReading& reading) {
  DeviceStep out;
  const std::int32_t numbers = difference(reading.counter, last_counter_);
  const std::int32_t stamps = difference(reading.timestamp_us, last_timestamp_us_);
  last_counter_ = reading.counter;
  last_timestamp_us_ = reading.timestamp_us;
  if (first_) {
    first_ = false;
    device_ns_ = 0;
    out.device_ns = device_ns_;
    return out;
  }
  // One of the two may stand still while the other carries the time; both at once are the same reading again.
  const bool by_stamps = has_timestamp_ && stamps != 0, by_numbers = has_counter_ && numbers != 0;
  if (!by_stamps && !by_numbers && (has_timestamp_ || has_counter_)) return std::nullopt;
  const double by_stamp = 1e3 * stamps, by_number = period_ns_ * numbers;
  out.stalled = has_timestamp_ && !by_stamps;
  if ((by_stamps && stamps < 0) || (by_numbers && numbers < 0)) out.restarted = true;
  if (by_stamps && by_numbers &&
      std::abs(by_stamp - by_number) > kStepToleranceNs + kStepToleranceShare * std::abs(by_number)) {
    out.restarted = true;
  }
  if (out.restarted) {
    device_ns_ = 0;
  } else {
    const double advance = by_stamps ? by_stamp : (by_numbers ? by_number : period_ns_);
    device_ns_ += static_cast<std::int64_t>(std::llround(advance));
    const double periods = by_numbers ? numbers : std::round(by_stamp / period_ns_);
    out.lost = static_cast<std::uint32_t>(std::max(0.0, periods - 1));
  }
  out.device_ns = device_ns_;
  return out;
}

namespace {

/// tm is the sending instant cut to whole milliseconds, so each frame bounds the age from both sides; all of
/// them together leave the least room.
Nanoseconds send_age(std::span<const StampedFeedback> poses) {
  constexpr Nanoseconds kMostAge = 100 * kMillisecond;
  Nanoseconds least = -kMostAge, most = kMostAge;
  for (const auto& p : poses) {
    const auto measured_ms = static_cast<std::uint32_t>(p.feedback.time_us / 1000);
    const Nanoseconds within_ms = (p.feedback.time_us % 1000) * kMicrosecond;
    const Nanoseconds floor_age =
        static_cast<std::int32_t>(p.feedback.tm_ms - measured_ms) * kMillisecond - within_ms;
    if (floor_age <= -kMillisecond || floor_age > kMostAge) return 0;
    least = std::max(least, floor_age);
    most = std::min(most, floor_age + kMillisecond);
  }
  // Jitter between reading the posture and sending can cross the bounds; their middle is still the best
  // guess.
  return poses.empty() ? 0 : (least + most) / 2;
}

}  // namespace

RobotClock::RobotClock(std::span<const StampedFeedback> poses) {
  has_time_ = std::all_of(poses.begin(), poses.end(), [](const auto& p) { return p.feedback.time_us >= 0; });
  if (has_time_) send_age_ns_ = send_age(poses);
  find_period(poses);
  if (has_time_ || poses.size() < 3) return;
  seqno_zero_ = poses.front().feedback.seqno;
  tm_zero_ms_ = poses.front().feedback.tm_ms;
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (const auto& p : poses) {
    const double x = difference(p.feedback.seqno, seqno_zero_),
                 y = 1e6 * difference(p.feedback.tm_ms, tm_zero_ms_);
    n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  const double determinant = n * sxx - sx * sx;
  if (determinant <= 0) return;
  const double slope = (n * sxy - sx * sy) / determinant, intercept = (sy - slope * sx) / n;
  double worst = 0;
  for (const auto& p : poses) {
    const double x = difference(p.feedback.seqno, seqno_zero_),
                 y = 1e6 * difference(p.feedback.tm_ms, tm_zero_ms_);
    worst = std::max(worst, std::abs(y - intercept - slope * x));
  }
  if (slope > 0 && worst < 1.5e6) {
    tm_period_ns_ = slope;
    tm_zero_ns_ = intercept;
  }
}

void RobotClock::find_period(std::span<const StampedFeedback> poses) {
  std::vector<double> periods;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const auto &a = poses[i - 1].feedback, &b = poses[i].feedback;
    const double numbers = difference(b.seqno, a.seqno);
    const double advance =
        has_time_ ? 1e3 * static_cast<double>(b.time_us - a.time_us) : 1e6 * difference(b.tm_ms, a.tm_ms);
    if (numbers > 0 && advance > 0) periods.push_back(advance / numbers);
  }
  // With a number that is no count of cycles there is nothing to hold the clock against.
  if (periods.empty() || 2 * periods.size() < poses.size()) return;
  const auto middle = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
  std::nth_element(periods.begin(), middle, periods.end());
  period_ns_ = *middle;
}

std::int64_t RobotClock::raw_ns(const wire::EgmFeedback& feedback) const {
  if (has_time_) return feedback.time_us * kMicrosecond;
  if (tm_period_ns_ > 0) {
    return static_cast<std::int64_t>(
        std::llround(tm_zero_ns_ + tm_period_ns_ * difference(feedback.seqno, seqno_zero_)));
  }
  return static_cast<std::int64_t>(difference(feedback.tm_ms, tm_zero_ms_)) * kMillisecond;
}

std::optional<DeviceStep> RobotClock::step(const StampedFeedback& pose) {
  DeviceStep out;
  out.device_ns = raw_ns(pose.feedback);
  if (!first_) {
    const Nanoseconds advance = out.device_ns - device_ns_;
    if (advance <= 0 && advance > -kReorder) return std::nullopt;
    const Nanoseconds beside_arrival = std::abs(advance - (pose.arrival.ns - arrival_ns_));
    const std::int32_t numbers = difference(pose.feedback.seqno, seqno_);
    const double beside_number = std::abs(static_cast<double>(advance) - period_ns_ * numbers);
    const bool counted = period_ns_ > 0 && numbers > 0 &&
                         beside_number > kRobotStepToleranceNs + kStepToleranceShare * period_ns_ * numbers;
    // A pause in sending parts clock and count, but not clock and arrival.
    out.restarted = advance < 0 || beside_arrival > kRobotStep ||
                    (counted && static_cast<double>(beside_arrival) > kRobotStepToleranceNs / 2);
  }
  first_ = false;
  seqno_ = pose.feedback.seqno;
  device_ns_ = out.device_ns;
  arrival_ns_ = pose.arrival.ns;
  return out;
}

}  // namespace weldcell::align
