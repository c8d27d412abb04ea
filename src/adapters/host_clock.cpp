#include "weldcell/adapters/host_clock.hpp"

#include <algorithm>
#include <array>

namespace weldcell::adapters {
namespace {

constexpr Nanoseconds kOldestStamp = kSecond;
constexpr Nanoseconds kFutureStamp = kMillisecond;

Nanoseconds read_clock(clockid_t clock) noexcept {
  std::timespec t{};
  clock_gettime(clock, &t);
  return t.tv_sec * kSecond + t.tv_nsec;
}

}  // namespace

HostTime now() noexcept { return {read_clock(CLOCK_MONOTONIC)}; }

HostTime from_realtime(const std::timespec& stamp) noexcept {
  const Nanoseconds monotonic = read_clock(CLOCK_MONOTONIC);
  const Nanoseconds age = read_clock(CLOCK_REALTIME) - (stamp.tv_sec * kSecond + stamp.tv_nsec);
  if (age > kOldestStamp || age < -kFutureStamp) return {monotonic};
  return {monotonic - std::max<Nanoseconds>(age, 0)};
}

std::int64_t unix_ms() noexcept { return read_clock(CLOCK_REALTIME) / kMillisecond; }

std::string utc_text(std::int64_t unix_ms) {
  const std::time_t whole = static_cast<std::time_t>(unix_ms / 1000);
  std::tm parts{};
  gmtime_r(&whole, &parts);
  std::array<char, 32> text{};
  const std::size_t length = std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &parts);
  return {text.data(), length};
}

}  // namespace weldcell::adapters
