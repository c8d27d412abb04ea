// What a localization tells of the laser: a clock that is not the one stated, a latency that drifts.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "weldcell/job/cell.hpp"

namespace weldcell::job {

namespace {

/// The clocks' mapping is held to 100 ppm: at that bound the clock is none of a quartz.
constexpr double kMostSkew_ppm = 95;
constexpr int kLatencyMemory = 10, kLeastJobs = 3;
constexpr double kLeastLimit_ms = 0.1;

}  // namespace

double Cell::latency_limit_ms() const { return std::max(kLeastLimit_ms, 2 * setup_.laser.latency_sigma_ms); }

bool Cell::latency_beyond() const {
  return latency_jobs_ >= kLeastJobs && std::abs(latency_drift_ms_) > latency_limit_ms();
}

void Cell::watch_laser() {
  char text[240];
  const align::AlignSummary& align = solution_->evidence.align;
  if (align.clock_resets + align.clock_stalls > 0) {
    std::snprintf(text, sizeof text,
                  "in this scan a clock of laser or robot was set or began anew (%llu), or the laser's stood "
                  "still (%llu): "
                  "each stretch was aligned by itself",
                  static_cast<unsigned long long>(align.clock_resets),
                  static_cast<unsigned long long>(align.clock_stalls));
    log(LogEvent::Level::Warning, text);
  }
  if (std::abs(align.laser_skew_ppm) > kMostSkew_ppm) {
    std::snprintf(
        text, sizeof text,
        "the laser sent some %.1f readings a second, laser.rate_hz says %g: readings are placed wrongly; "
        "correct laser.rate_hz or the sensor's rate",
        align.laser_rate_hz, setup_.laser.rate_hz);
    log(LogEvent::Level::Warning, text);
  }
  if (!solution_->found.latency_s || solution_->verdict.verdict != localize::Verdict::Weld) return;
  latency_jobs_ = std::min(latency_jobs_ + 1, kLatencyMemory);
  latency_drift_ms_ += (1e3 * *solution_->found.latency_s - latency_drift_ms_) / latency_jobs_;
  const bool drifted = latency_beyond();
  if (drifted && !latency_drifted_) {
    std::snprintf(
        text, sizeof text,
        "the laser's latency has drifted: the last jobs found %+.2f ms beside laser.latency_ms %.2f, more "
        "than %.2f ms; measure it (weldcell calibrate latency)",
        latency_drift_ms_, setup_.laser.latency_ms, latency_limit_ms());
    log(LogEvent::Level::Warning, text);
  }
  latency_drifted_ = drifted;
}

}  // namespace weldcell::job
