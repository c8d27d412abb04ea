// The host's clocks: the only place that reads them. Real-time safe, any thread.
#pragma once

#include <cstdint>
#include <ctime>
#include <string>

#include "weldcell/base/time.hpp"

namespace weldcell::adapters {

/// CLOCK_MONOTONIC.
HostTime now() noexcept;

/// The monotonic instant of a CLOCK_REALTIME stamp (kernel receive stamps), by the offset between the clocks
/// at this moment. Never later than now(). A stamp older than one second, or from the future by more than a
/// millisecond, is taken as a stepped clock and gives now().
HostTime from_realtime(const std::timespec& stamp) noexcept;

/// CLOCK_REALTIME in milliseconds since 1970, for names and reports; never for control.
std::int64_t unix_ms() noexcept;
/// "2026-01-31T14:05:09Z" of such a time.
std::string utc_text(std::int64_t unix_ms);

}  // namespace weldcell::adapters
