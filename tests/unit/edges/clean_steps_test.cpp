#include <gtest/gtest.h>

#include <cstdio>

#include "step_profile.hpp"
#include "weldcell/edges/edges.hpp"

namespace weldcell::edges {
namespace {

constexpr std::uint64_t kSeed = 44101;

EdgeOptions options_for(const StepProfile& p) {
  EdgeOptions o;
  o.height_mm = p.height_mm;
  o.spot_mm = p.spot_mm;
  o.noise_mm = p.noise_mm;
  o.triangulation_rad = p.triangulation_rad;
  o.light_threshold = p.threshold;
  o.outline = bar_outline(p);
  o.model_sigma_mm = 0;
  o.time_sigma_s = 0;
  return o;
}

struct Tally {
  double square = 0, sum = 0, pull = 0;
  int edges = 0, wrong = 0;
  double rmse() const { return std::sqrt(square / edges); }
  double mean() const { return sum / edges; }
};

/// Errors are positive outwards, away from the bar.
Tally run(StepProfile p, int bars, std::mt19937_64& random) {
  Tally tally;
  std::uniform_real_distribution<double> uniform;
  for (int i = 0; i < bars; ++i) {
    p.phase = uniform(random);
    p.backward = i % 2 == 1;
    const EdgeScan scan = detect(scan_bar(p, random), options_for(p));
    if (scan.edges.size() != 2 || scan.edges[0].step != 1 || scan.edges[1].step != -1) {
      ++tally.wrong;
      continue;
    }
    for (int e = 0; e < 2; ++e) {
      const EdgePoint& edge = scan.edges[static_cast<std::size_t>(e)];
      const bool left = (e == 0) != p.backward;
      const double error = left ? -edge.x_mm : edge.x_mm - p.width_mm;
      tally.square += error * error;
      tally.sum += error;
      tally.pull += (error / edge.sigma_mm) * (error / edge.sigma_mm);
      ++tally.edges;
    }
  }
  return tally;
}

double bound(const StepProfile& p) {
  const double blur = p.spot_mm / 4, motion = p.speed_mm_s * p.exposure_s;
  const double s = std::sqrt(blur * blur + motion * motion / 12);
  return 1.883 * p.noise_mm / p.height_mm * std::sqrt(s * p.speed_mm_s / p.rate_hz);
}

TEST(CleanSteps, NoneMissedOrInventedAndCloseToTheBound) {
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  std::mt19937_64 random(kSeed);
  int total = 0;
  for (const double height : {3.0, 5.0}) {
    for (const double rate : {1500.0, 5000.0, 20000.0}) {
      for (const double speed : {100.0, 300.0, 500.0}) {
        StepProfile p;
        p.height_mm = height;
        p.noise_mm = 0.15;
        p.rate_hz = rate;
        p.speed_mm_s = speed;
        p.exposure_s = 0.2e-3;
        if (p.exposure_s > 1 / rate) p.exposure_s = 1 / rate;
        const Tally t = run(p, 280, random);
        total += t.edges;
        std::printf(
            "h %.0f  %5.0f Hz  %3.0f mm/s: rmse %.4f  bound %.4f  ratio %.3f  mean %+.4f  pull %.2f  wrong "
            "%d\n",
            height, rate, speed, t.rmse(), bound(p), t.rmse() / bound(p), t.mean(),
            std::sqrt(t.pull / t.edges), t.wrong);
        EXPECT_EQ(t.wrong, 0);
        EXPECT_LE(t.rmse(), 1.15 * bound(p));
        EXPECT_GT(std::sqrt(t.pull / t.edges), 0.6);
        EXPECT_LT(std::sqrt(t.pull / t.edges), 1.25);
      }
    }
  }
  EXPECT_GE(total, 10000);
}

TEST(Outliers, TwoPercentCostLittle) {
  std::mt19937_64 random(kSeed + 1);
  for (const double rate : {1500.0, 5000.0, 20000.0}) {
    StepProfile p;
    p.height_mm = 3;
    p.noise_mm = 0.15;
    p.rate_hz = rate;
    p.speed_mm_s = 300;
    p.outliers = 0.02;
    const Tally t = run(p, 300, random);
    std::printf("outliers %5.0f Hz: rmse %.4f  ratio %.3f  pull %.2f  wrong %d of %d\n", rate, t.rmse(),
                t.rmse() / bound(p), std::sqrt(t.pull / t.edges), t.wrong, t.edges / 2 + t.wrong);
    EXPECT_EQ(t.wrong, 0);
    EXPECT_LE(t.rmse(), 1.6 * bound(p));
  }
}

TEST(CorrelatedNoise, StatesALargerSigma) {
  std::mt19937_64 random(kSeed + 2);
  StepProfile p;
  p.height_mm = 3;
  p.noise_mm = 0.15;
  p.rate_hz = 5000;
  p.speed_mm_s = 200;
  p.correlation = 0.9;
  const Tally t = run(p, 300, random);
  std::printf("AR 0.9: rmse %.4f pull %.2f wrong %d\n", t.rmse(), std::sqrt(t.pull / t.edges), t.wrong);
  EXPECT_EQ(t.wrong, 0);
  EXPECT_LT(std::sqrt(t.pull / t.edges), 1.6);
}

TEST(SlowAndFast, EveryRateAndSpeedIsSeen) {
  std::mt19937_64 random(kSeed + 3);
  for (const auto& [rate, speed] :
       {std::pair{50000.0, 20.0}, {50000.0, 500.0}, {1500.0, 20.0}, {1500.0, 500.0}}) {
    StepProfile p;
    p.rate_hz = rate;
    p.speed_mm_s = speed;
    for (const bool peak : {false, true}) {
      p.peak = peak;
      const Tally t = run(p, 10, random);
      std::printf("h 40 %5.0f Hz %3.0f mm/s %s: rmse %.4f mean %+.4f pull %.2f wrong %d\n", rate, speed,
                  peak ? "peak" : "mean", t.rmse(), t.mean(), std::sqrt(t.pull / t.edges), t.wrong);
      EXPECT_EQ(t.wrong, 0);
      EXPECT_LT(t.rmse(), std::max(0.03, 1.5 * speed / rate / std::sqrt(12.0)));
    }
  }
}

TEST(PaperMethod, FindsJumpsAndDropsWideSlots) {
  std::mt19937_64 random(kSeed + 4);
  StepProfile p;
  p.height_mm = 5;
  p.peak = true;
  p.rate_hz = 1500;
  p.speed_mm_s = 300;
  EdgeOptions o = options_for(p);
  o.method = Method::Paper;
  const EdgeScan fine = detect(scan_bar(p, random), o);
  ASSERT_EQ(fine.edges.size(), 2U);
  EXPECT_NEAR(fine.edges[0].x_mm, 0, 0.25);
  EXPECT_NEAR(fine.edges[1].x_mm, p.width_mm, 0.25);
  p.rate_hz = 400;
  const EdgeScan coarse = detect(scan_bar(p, random), o);
  EXPECT_TRUE(coarse.edges.empty());
  EXPECT_EQ(coarse.summary.paper_slot_too_wide, 2U);
}

}  // namespace
}  // namespace weldcell::edges
