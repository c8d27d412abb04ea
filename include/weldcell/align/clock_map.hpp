// Device clock -> host clock from one-way traffic: lower envelope of (arrival - device time) with bounded
// skew. Pure.
#pragma once

#include <cstdint>
#include <vector>

#include "weldcell/base/time.hpp"

namespace weldcell::align {

struct ClockMapOptions {
  double max_skew_ppm = 100;  ///< a line steeper than this is clamped: quartz is never that bad
  double window_s = 30;  ///< span of one line; must be many times the correlation time of the wire's load
};

/// The mapping: one line per window, cross-faded between the windows' centres. It maps a device instant to
/// the instant at which the fastest message would have arrived, so the least transport delay stays in it as a
/// constant.
class ClockMap {
 public:
  HostTime to_host(std::int64_t device_ns) const;
  /// Slope of the first to the last window against the device clock, parts per million (host runs faster:
  /// positive).
  double skew_ppm() const { return skew_ppm_; }
  /// Stated 1 sigma of the mapping's error over the whole span, its constant excluded, microseconds.
  double sigma_us() const { return sigma_us_; }

 private:
  friend class ClockMapBuilder;
  struct Line {
    double intercept_ns = 0, slope = 0;
  };
  std::int64_t device_zero_ns_ = 0, host_zero_ns_ = 0;
  double first_centre_ns_ = 0, stride_ns_ = 1;
  std::vector<Line> lines_;
  double skew_ppm_ = 0, sigma_us_ = 0;
};

/// Collects messages in order of device time. Memory grows by a few hundred bytes a second of traffic,
/// whatever its rate. Source of the envelope: Zhang, Liu, Xia, INFOCOM 2002; of the bound on skew: Olson
/// 2010.
class ClockMapBuilder {
 public:
  explicit ClockMapBuilder(ClockMapOptions options = {}) : options_(options) {}

  /// device_ns must increase. Of messages that arrive together only the youngest counts: the others waited
  /// for it.
  void add(std::int64_t device_ns, HostTime arrival);
  bool empty() const { return !started_; }
  ClockMap finish();

 private:
  struct Vertex {
    double x = 0, y = 0;  ///< device time, arrival minus device time; ns from the first message
  };
  using Hull = std::vector<Vertex>;
  static void push(Hull& hull, Vertex vertex);
  void flush();
  ClockMap::Line fit(const Hull& hull) const;
  double stated_sigma_ns(std::size_t first_bin, std::size_t end_bin, const ClockMap::Line& line) const;

  ClockMapOptions options_;
  bool started_ = false;
  std::int64_t device_zero_ns_ = 0, host_zero_ns_ = 0;
  Vertex pending_;
  std::int64_t pending_arrival_ns_ = 0;
  std::vector<Hull> bins_;
};

}  // namespace weldcell::align
