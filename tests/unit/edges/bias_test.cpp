#include <gtest/gtest.h>

#include <cstdio>

#include "step_profile.hpp"
#include "weldcell/edges/edges.hpp"

namespace weldcell::edges {
namespace {

constexpr std::uint64_t kSeed = 44201;

EdgeOptions options_for(const StepProfile& p) {
  EdgeOptions o;
  o.height_mm = p.height_mm;
  o.spot_mm = p.spot_mm;
  o.noise_mm = p.noise_mm;
  o.triangulation_rad = p.triangulation_rad;
  o.light_threshold = p.threshold;
  o.outline = bar_outline(p);
  return o;
}

TEST(Silhouette, UnbiasedForSharpAndRoundCorners) {
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> uniform;
  for (const double radius : {0.0, 1.0, 2.0, 4.0, 6.0}) {
    for (const bool peak : {false, true}) {
      for (const double noise : {0.05, 0.15}) {
        StepProfile p;
        p.radius_mm = radius;
        p.peak = peak;
        p.noise_mm = noise;
        double sum = 0, square = 0;
        int edges = 0;
        for (int i = 0; i < 40; ++i) {
          p.phase = uniform(random);
          p.backward = i % 2 == 1;
          const EdgeScan scan = detect(scan_bar(p, random), options_for(p));
          ASSERT_EQ(scan.edges.size(), 2U) << "radius " << radius << " peak " << peak << " case " << i;
          for (const EdgePoint& e : scan.edges) {
            const double error = e.x_mm < 0.5 * p.width_mm ? -e.x_mm : e.x_mm - p.width_mm;
            sum += error;
            square += error * error;
            ++edges;
            EXPECT_NEAR(scan.top_z_mm[0], 540, 0.2);
            EXPECT_NEAR(scan.table_z_mm[0], 500, 0.1);
          }
        }
        const double mean = sum / edges, rms = std::sqrt(square / edges);
        std::printf("r %.0f %s noise %.2f: bias %+.4f rms %.4f\n", radius, peak ? "peak" : "mean", noise,
                    mean, rms);
        EXPECT_LE(std::abs(mean), 0.05);
        EXPECT_LE(rms, 0.07);
      }
    }
  }
}

TEST(Shadow, LastUpperReadingCorrected) {
  std::mt19937_64 random(kSeed + 1);
  std::uniform_real_distribution<double> uniform;
  for (const auto& [height, radius, theta] : {std::tuple{40.0, 0.0, 0.3},
                                              {40.0, 4.0, 0.3},
                                              {40.0, 4.0, 0.2},

                                              {10.0, 0.0, 0.349},
                                              {5.0, 0.0, 0.349},
                                              {3.0, 0.0, 0.349},
                                              {2.0, 0.0, 0.349},
                                              {3.0, 0.0, 0.2}}) {
    for (const bool peak : {false, true}) {
      for (const int receiver : {1, -1}) {
        StepProfile p;
        p.height_mm = height;
        p.radius_mm = radius;
        p.triangulation_rad = theta;
        p.peak = peak;
        p.receiver = receiver;
        double clean = 0, dark = 0, pull = 0;
        int clean_edges = 0, dark_edges = 0;
        for (int i = 0; i < 10; ++i) {
          p.phase = uniform(random);
          p.backward = i % 2 == 1;
          const EdgeScan scan = detect(scan_bar(p, random), options_for(p));
          for (const EdgePoint& e : scan.edges) {
            const double error = e.x_mm < 0.5 * p.width_mm ? -e.x_mm : e.x_mm - p.width_mm;
            (e.shadowed ? dark : clean) += error;
            ++(e.shadowed ? dark_edges : clean_edges);
            pull = std::max(pull, std::abs(error) / e.sigma_mm);
          }
        }
        std::printf(
            "h %.0f r %.0f theta %.2f %s receiver %+d: clean %d bias %+.3f, shadowed %d bias %+.3f, worst "
            "pull %.2f\n",
            height, radius, theta, peak ? "peak" : "mean", receiver, clean_edges,
            clean / std::max(1, clean_edges), dark_edges, dark / std::max(1, dark_edges), pull);
        EXPECT_EQ(clean_edges + dark_edges, 20);
        EXPECT_GE(dark_edges, height >= 10 ? 10 : 0);
        EXPECT_LE(std::abs(dark), 0.1 * std::max(1, dark_edges));
        EXPECT_LE(std::abs(clean), 0.1 * clean_edges);
      }
    }
  }
}

TEST(Oblique, ReceiverAcrossTheTravelOfATurnedBar) {
  std::mt19937_64 random(kSeed + 2);
  std::uniform_real_distribution<double> uniform;
  for (const double radius : {0.0, 4.0}) {
    for (const double turned_deg : {-45.0, -20.0, -8.0, -4.0, -2.0, 1.0, 3.0, 5.0, 12.0, 20.0, 35.0}) {
      StepProfile p;
      p.radius_mm = radius;
      p.peak = uniform(random) < 0.5;
      p.turned_rad = turned_deg * 0.017453292519943295;
      const double across = p.width_mm / std::cos(p.turned_rad);
      for (const bool known : {true, false}) {
        EdgeOptions o = options_for(p);
        if (!known) o.outline.clear();
        double left = 0, right = 0, pull = 0;
        for (int i = 0; i < 4; ++i) {
          p.phase = uniform(random);
          p.backward = i % 2 == 1;
          const EdgeScan scan = detect(scan_bar(p, random), o);
          ASSERT_EQ(scan.edges.size(), 2U) << "radius " << radius << " turned " << turned_deg;
          for (const EdgePoint& e : scan.edges) {
            const bool first = e.x_mm < 0.5 * across;
            const double error = (first ? -e.x_mm : e.x_mm - across) * std::cos(p.turned_rad);
            (first ? left : right) += error / 4;
            pull = std::max(pull, std::abs(error) / (e.sigma_mm * std::cos(p.turned_rad)));
          }
        }
        std::printf("r %.0f turned %+3.0f deg, normal %s: bias %+.3f %+.3f, worst pull %.2f\n", radius,
                    turned_deg, known ? "known" : "unknown", left, right, pull);
        EXPECT_LE(std::abs(left), known ? 0.06 : 0.6);
        EXPECT_LE(std::abs(right), known ? 0.06 : 0.6);
      }
    }
  }
}

}  // namespace
}  // namespace weldcell::edges
