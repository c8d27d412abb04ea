#include "weldcell/calibrate/latency.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

namespace weldcell::calibrate {
namespace {

constexpr std::uint64_t kSeed = 48001;

struct Gauge {
  double latency_ms = 2, bias_mm = 0.05, sigma_mm = 0.02;
  std::vector<double> speeds{100, 300, 500};
  int passes = 3, edges = 1;
  bool forward = true, backward = true;
  double outliers = 0;
};

std::vector<GaugeCrossing> crossings(const Gauge& g, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  std::vector<GaugeCrossing> out;
  for (int edge = 0; edge < g.edges; ++edge) {
    for (const double speed : g.speeds) {
      for (int pass = 0; pass < g.passes; ++pass) {
        for (const int direction : {1, -1}) {
          if (direction > 0 ? !g.forward : !g.backward) continue;
          GaugeCrossing c;
          c.edge = edge;
          c.direction = direction;
          c.speed_mm_s = speed;
          c.sigma_mm = g.sigma_mm;
          c.across_mm = 37.5 + 10 * edge + direction * (1e-3 * speed * g.latency_ms + g.bias_mm) +
                        g.sigma_mm * normal(random);
          if (uniform(random) < g.outliers) c.across_mm += 5 * (uniform(random) - 0.5);
          out.push_back(c);
        }
      }
    }
  }
  return out;
}

TEST(LatencyFit, RecoversLatencyAndBiasWithinItsCovariance) {
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  std::mt19937_64 random(kSeed);
  int inside = 0, trials = 0;
  int within_bar = 0;
  double square = 0;
  for (const double latency : {0.0, 0.5, 2.7, 10.0}) {
    for (int i = 0; i < 100; ++i) {
      Gauge g;
      g.latency_ms = latency;
      g.outliers = 0.03;
      const auto fit = fit_latency(crossings(g, random));
      ASSERT_TRUE(fit.ok()) << fit.error().text();
      const double error = fit->latency_ms - latency;
      within_bar += std::abs(error) <= 0.1 ? 1 : 0;
      square += error * error;
      inside += std::abs(error) <= 2 * fit->sigma_ms() ? 1 : 0;
      ++trials;
    }
  }
  std::printf("rms %.4f ms, within 0.1 ms %d, inside 2 sigma %d of %d\n", std::sqrt(square / trials),
              within_bar, inside, trials);
  // Three sigmas of a single gauge scan reach 0.1 ms: one draw in a hundred may pass it.
  EXPECT_GE(within_bar, trials * 99 / 100);
  EXPECT_LE(std::sqrt(square / trials), 0.045);
  EXPECT_GE(inside, trials * 88 / 100);
}

TEST(LatencyFit, EdgesWithTheirOwnPlacesShareOneLatency) {
  std::mt19937_64 random(kSeed + 1);
  Gauge g;
  g.edges = 4;
  const auto fit = fit_latency(crossings(g, random));
  ASSERT_TRUE(fit.ok()) << fit.error().text();
  EXPECT_NEAR(fit->latency_ms, 2, 0.06);
  EXPECT_NEAR(fit->bias_mm, 0.05, 0.02);
  ASSERT_EQ(fit->edge_mm.size(), 4U);
  EXPECT_NEAR(fit->edge_mm[3], 67.5, 0.02);
}

std::string refusal(const Gauge& g) {
  std::mt19937_64 random(kSeed + 2);
  const auto fit = fit_latency(crossings(g, random));
  return fit.ok() ? "" : fit.error().text();
}

TEST(LatencyFit, RefusesWhatCannotTellLatencyFromBias) {
  Gauge one_speed, one_way, near_speeds, noisy, few;
  one_speed.speeds = {300};
  one_speed.passes = 20;
  EXPECT_NE(refusal(one_speed).find("one speed, 300 mm/s"), std::string::npos) << refusal(one_speed);
  one_way.backward = false;
  EXPECT_NE(refusal(one_way).find("one direction"), std::string::npos) << refusal(one_way);
  near_speeds.speeds = {280, 310, 345};
  near_speeds.passes = 20;
  EXPECT_NE(refusal(near_speeds).find("too alike"), std::string::npos) << refusal(near_speeds);
  noisy.sigma_mm = 0.5;
  EXPECT_NE(refusal(noisy).find("known to"), std::string::npos) << refusal(noisy);
  few.passes = 1;
  few.speeds = {100, 300};
  EXPECT_NE(refusal(few).find("crossings, at least"), std::string::npos) << refusal(few);
}

}  // namespace
}  // namespace weldcell::calibrate
