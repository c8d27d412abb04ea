// Host and device time as integer nanoseconds. Pure: time is always an argument, there is no clock here.
#pragma once

#include <compare>
#include <cstdint>

namespace weldcell {

/// A span of time in nanoseconds.
using Nanoseconds = std::int64_t;

/// An instant on the host's monotonic clock (or the virtual clock that stands for it), nanoseconds.
struct HostTime {
  Nanoseconds ns = 0;
  auto operator<=>(const HostTime&) const = default;
};

constexpr HostTime operator+(HostTime t, Nanoseconds d) { return {t.ns + d}; }
constexpr HostTime operator-(HostTime t, Nanoseconds d) { return {t.ns - d}; }
constexpr Nanoseconds operator-(HostTime a, HostTime b) { return a.ns - b.ns; }

constexpr Nanoseconds kMicrosecond = 1'000;
constexpr Nanoseconds kMillisecond = 1'000'000;
constexpr Nanoseconds kSecond = 1'000'000'000;

constexpr double seconds(Nanoseconds d) { return static_cast<double>(d) * 1e-9; }
constexpr Nanoseconds from_seconds(double s) { return static_cast<Nanoseconds>(s * 1e9); }

}  // namespace weldcell
