// Keeps the requests to a controller below 20 a second: a token bucket on the caller's clock. Pure.
#pragma once

#include <algorithm>

#include "weldcell/base/time.hpp"

namespace weldcell::wire {

class RwsPace {
 public:
  /// At most `burst` requests at once, then one every `interval`: never more than burst + 1 s / interval
  /// within any second. The controllers answer 503 from 20 a second on.
  explicit RwsPace(Nanoseconds interval = kSecond / 16, int burst = 2)
      : interval_(interval), depth_(interval * (burst - 1)) {}

  /// How long the next request has to wait, from `now`; 0 when it may start.
  Nanoseconds wait(HostTime now) const { return std::max<Nanoseconds>(0, due_ - depth_ - now); }
  /// A request starts now.
  void started(HostTime now) { due_ = std::max(due_, now) + interval_; }
  /// No request before that instant (after a 503).
  void hold_until(HostTime t) { due_ = std::max(due_, t + depth_); }

 private:
  Nanoseconds interval_, depth_;
  HostTime due_{-(std::int64_t{1} << 62)};  ///< when the bucket is full again, less its depth
};

}  // namespace weldcell::wire
