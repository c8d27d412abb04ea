// Od5000: one datagram a feed.
#include <cmath>

#include "weldcell/wire/laser_dialects.hpp"

namespace weldcell::wire {
namespace {

constexpr double kMmPerCount = 1e-6;
constexpr std::size_t kHeaderBytes = 14, kLengthBytes = 2;
/// Between two datagrams that need no third to confirm them, and the longest over which 2 % of rate still
/// tell the seconds.
constexpr double kShortGap_us = 4e5, kLongGap_us = 20e6;

std::uint32_t at(const std::byte* p, int i) { return static_cast<std::uint32_t>(p[i]); }
std::uint32_t big(const std::byte* p) { return at(p, 3) | at(p, 2) << 8 | at(p, 1) << 16 | at(p, 0) << 24; }

}  // namespace

void LaserDatagramDecoder::reset() {
  const LaserCounters kept = counters_;
  *this = LaserDatagramDecoder(format_);
  counters_ = kept;
}

std::uint32_t LaserDatagramDecoder::open(std::span<const std::byte> datagram) noexcept {
  const std::byte* p = datagram.data();
  const std::size_t frame_bytes = 4 * format_.words;
  const bool long_enough = datagram.size() > kHeaderBytes;
  const std::size_t length = long_enough ? (at(p, 0) << 8 | at(p, 1)) & 0xFFF : 0;
  const std::size_t payload = datagram.size() - (long_enough ? kHeaderBytes : 0);
  const auto readings = static_cast<std::uint32_t>(payload / frame_bytes);
  Mark now;
  if (long_enough) now = {big(p + 6), big(p + 10), 0, true};
  const bool sound = long_enough && at(p, 0) >> 4 == 0xD && length + kLengthBytes == datagram.size() &&
                     payload % frame_bytes == 0 && now.time_ns < 1'000'000'000;
  if (!sound || !place(now, readings)) {
    ++counters_.resyncs;
    counters_.skipped_bytes += datagram.size();
    return 0;
  }
  older_ = mark_;
  mark_ = now;
  doubt_.known = false;
  next_counter_ = now.counter + readings;
  ++counters_.blocks;
  counters_.readings += readings;
  return readings;
}

bool LaserDatagramDecoder::place(Mark& now, std::uint32_t readings) noexcept {
  const auto ahead = static_cast<std::int32_t>(now.counter - next_counter_);
  if (!mark_.known) {
    now.us = now.time_ns / 1000;
    return true;
  }
  const bool goes_on = follows(mark_, now, kShortGap_us);
  if (goes_on || (older_.known && follows(older_, now, kShortGap_us))) {
    // Doubled or overtaken on the way: its readings were taken or counted as lost.
    if (now.counter == mark_.counter && now.time_ns == mark_.time_ns) return false;
    if (goes_on && static_cast<std::int32_t>(now.counter + readings - mark_.counter) <= 0) return false;
    settled_ = true;
    if (ahead > 0) counters_.lost_readings += static_cast<std::uint32_t>(ahead);
    return true;
  }
  // Damaged, or a sensor that was silent or switched on anew: the next datagram decides. The very first one
  // is no more to be believed than the second.
  const bool again = doubt_.known && now.counter == doubt_next_ && follows(doubt_, now, kShortGap_us);
  if (settled_ && !again) {
    doubt_ = now;
    doubt_.us = now.time_ns / 1000;
    doubt_next_ = now.counter + readings;
    return false;
  }
  if (settled_ && ahead > 0 && follows(mark_, now, kLongGap_us)) {
    counters_.lost_readings += static_cast<std::uint32_t>(ahead);
  } else if (settled_) {
    ++counters_.restarts;
  } else {
    now.us = now.time_ns / 1000;
  }
  return true;
}

bool LaserDatagramDecoder::follows(const Mark& from, Mark& to, double longest_us) const noexcept {
  // The clock starts anew every second; how many seconds have passed is told by the count and the rate.
  const double counted_us = static_cast<std::int32_t>(to.counter - from.counter) * 1e6 / format_.rate_hz;
  if (std::abs(counted_us) > longest_us) return false;
  const double step_us = (static_cast<double>(to.time_ns) - static_cast<double>(from.time_ns)) / 1e3;
  const double seconds = std::round((counted_us - step_us) / 1e6);
  const double tolerance_us = 20 + 0.02 * std::abs(counted_us);
  if (std::abs(counted_us - step_us - seconds * 1e6) > tolerance_us) return false;
  to.us = from.us - from.time_ns / 1000 + to.time_ns / 1000 +
          static_cast<std::uint32_t>(static_cast<std::int64_t>(seconds) * 1'000'000);
  return true;
}

void LaserDatagramDecoder::read(std::span<const std::byte> datagram, std::uint32_t index,
                                LaserReading& out) const noexcept {
  const std::byte* p = datagram.data() + kHeaderBytes + 4 * (index * format_.words + format_.distance_word);
  const std::uint32_t word = big(p);
  const auto counts = static_cast<std::int32_t>(word);
  out = LaserReading{};
  if (counts >= static_cast<std::int32_t>(kLaserFirstErrorCode)) out.code = word;
  out.distance_mm = static_cast<float>(counts * kMmPerCount);
  out.counter = mark_.counter + index;
  out.timestamp_us = mark_.us + static_cast<std::uint32_t>(std::llround(index * 1e6 / format_.rate_hz));
}

}  // namespace weldcell::wire
