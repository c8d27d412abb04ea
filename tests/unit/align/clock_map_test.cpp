#include "weldcell/align/clock_map.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

namespace weldcell::align {
namespace {

constexpr std::uint64_t kSeed = 43001;

/// The wire: how late a block may be.
struct Wire {
  double floor_s = 0.25e-3, jitter_s = 0.2e-3;
  double burst_share = 0, burst_s = 0;    ///< share of blocks held up by an exponential delay
  double stall_every_s = 0, stall_s = 0;  ///< everything waits until the stall ends
  double queue_s = 0, queue_correlation_s = 0;
};

struct Error {
  double std_us = 0, mean_us = 0, sigma_us = 0, skew_ppm = 0;
};

/// Blocks of 4 ms, host time as truth, device clock drifting by ppm; errors sampled over the whole span.
Error simulate(const Wire& wire, double duration_s, double ppm, std::mt19937_64& random,
               double wander_ppm_s = 0) {
  std::exponential_distribution<double> exponential(1);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> normal;
  const auto device = [&](double t) {
    return static_cast<std::int64_t>(
               std::llround(1e9 * (t * (1 + 1e-6 * ppm) + 0.5e-6 * wander_ppm_s * t * t))) /
           1000 * 1000;
  };
  ClockMapBuilder builder;
  double last_arrival = 0, queue = 0;
  for (double t = 0; t < duration_s; t += 4e-3) {
    double delay = wire.floor_s + wire.jitter_s * exponential(random);
    if (uniform(random) < wire.burst_share) delay += wire.burst_s * exponential(random);
    if (wire.queue_s > 0) {
      const double keep = std::exp(-4e-3 / wire.queue_correlation_s);
      queue = keep * queue + std::sqrt(1 - keep * keep) * normal(random);
      delay += wire.queue_s * std::abs(queue);
    }
    double arrival = t + delay;
    if (wire.stall_every_s > 0) {
      const double phase = std::fmod(arrival, wire.stall_every_s);
      if (phase < wire.stall_s) arrival += wire.stall_s - phase;
    }
    arrival = std::max(arrival, last_arrival);
    last_arrival = arrival;
    builder.add(device(t), HostTime{from_seconds(5 + arrival)});
  }
  const ClockMap map = builder.finish();
  Error out;
  double n = 0, sum = 0, square = 0;
  for (double t = 0; t < duration_s; t += duration_s / 997) {
    const double e = 1e6 * (seconds(map.to_host(device(t)) - HostTime{from_seconds(5)}) - t - wire.floor_s);
    n += 1, sum += e, square += e * e;
  }
  out.mean_us = sum / n;
  out.std_us = std::sqrt(std::max(0.0, square / n - out.mean_us * out.mean_us));
  out.sigma_us = map.sigma_us();
  out.skew_ppm = map.skew_ppm();
  return out;
}

struct Case {
  const char* name;
  Wire wire;
  double duration_s;
};

TEST(ClockMap, KeepsTheStatedSigmaOnLoadedWires) {
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  const Case cases[] = {
      {"quiet 30 s", {}, 30},
      {"quiet 5 s", {}, 5},
      {"bursts and 50 ms stalls, 60 s", {0.25e-3, 0.5e-3, 0.05, 5e-3, 1.7, 0.05, 0, 0}, 60},
      {"bursts and 50 ms stalls, 10 s", {0.25e-3, 0.5e-3, 0.05, 5e-3, 1.7, 0.05, 0, 0}, 10},
      {"queue 0.2 s, 60 s", {0.25e-3, 0.1e-3, 0, 0, 0, 0, 0.4e-3, 0.2}, 60},
      {"queue 2 s, 60 s", {0.25e-3, 0.1e-3, 0, 0, 0, 0, 0.4e-3, 2}, 60},
  };
  std::mt19937_64 random(kSeed);
  for (const Case& c : cases) {
    constexpr int kTrials = 200;
    int covered = 0;
    double worst = 0, mean_sigma = 0, square = 0;
    for (int i = 0; i < kTrials; ++i) {
      const Error e = simulate(c.wire, c.duration_s, i % 2 == 0 ? 30 : -47, random);
      covered += e.std_us <= 2 * e.sigma_us ? 1 : 0;
      worst = std::max(worst, e.std_us);
      square += e.std_us * e.std_us / kTrials;
      mean_sigma += e.sigma_us / kTrials;
    }
    std::printf("%-32s std rms %.2f worst %.2f us, stated sigma %.2f us, covered %d of %d\n", c.name,
                std::sqrt(square), worst, mean_sigma, covered, kTrials);
    EXPECT_LE(std::sqrt(square), 20);
    EXPECT_GE(covered, kTrials * 95 / 100);
  }
}

TEST(ClockMap, FollowsAWanderingClockOverAnHour) {
  std::mt19937_64 random(kSeed + 1);
  const Error e = simulate({0.25e-3, 0.5e-3, 0.05, 5e-3, 1.7, 0.05, 0, 0}, 3600, 20, random, 0.005);
  std::printf("wander 0.005 ppm/s over 1 h: std %.2f us, skew %.2f ppm\n", e.std_us, e.skew_ppm);
  EXPECT_LE(e.std_us, 20);
}

TEST(ClockMap, BoundsTheSkewOfAShortScan) {
  ClockMapBuilder builder;
  builder.add(0, HostTime{0});
  builder.add(10'000'000, HostTime{14'000'000});
  builder.add(20'000'000, HostTime{29'000'000});
  const ClockMap map = builder.finish();
  EXPECT_NEAR(map.skew_ppm(), 100, 1e-9);
  EXPECT_GT(map.sigma_us(), 15);
}

}  // namespace
}  // namespace weldcell::align
