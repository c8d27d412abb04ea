#include "weldcell/localize/height.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace weldcell::localize {
namespace {

TEST(Height, TiltedTableAndPartAreFoundThroughWrongHeights) {
  constexpr std::uint64_t kSeed = 1203;
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> place(-500, 500);
  std::normal_distribution<double> noise(0, 0.1);
  const Vec2 reference(900, 100);
  std::vector<EdgePoint> edges;
  std::vector<double> top, table;
  for (int i = 0; i < 150; ++i) {
    EdgePoint e;
    e.x_mm = reference.x() + place(random);
    e.y_mm = reference.y() + place(random);
    const double floor = 12 + 0.004 * (e.x_mm - reference.x()) - 0.003 * (e.y_mm - reference.y());
    edges.push_back(e);
    table.push_back(floor + noise(random));
    top.push_back(i % 5 == 0 ? floor + 3 : floor + 40 + noise(random));
  }
  table[7] = std::nan("");
  const HeightFit fit = fit_heights(edges, top, table, reference);
  ASSERT_TRUE(fit.top && fit.table);
  EXPECT_NEAR(fit.table->z_mm, 12, 0.05);
  EXPECT_NEAR(fit.table->slope_x, 0.004, 2e-4);
  EXPECT_NEAR(fit.table->slope_y, -0.003, 2e-4);
  EXPECT_NEAR(fit.top->z_mm, 52, 0.06) << "seed " << kSeed;
  EXPECT_NEAR(fit.top->slope_x, 0.004, 2e-4);
  EXPECT_EQ(fit.top->points, 120);
  EXPECT_NEAR(fit.top->rms_mm, 0.1, 0.03);
  EXPECT_LT(std::abs(fit.table->z_mm - 12), 5 * std::sqrt(fit.table->covariance(0, 0)));
}

TEST(Height, TooFewHeightsGiveNoPlane) {
  const std::vector<EdgePoint> edges(5);
  const std::vector<double> z(5, 1.0);
  const HeightFit fit = fit_heights(edges, z, {}, Vec2::Zero());
  EXPECT_FALSE(fit.top);
  EXPECT_FALSE(fit.table);
}

}  // namespace
}  // namespace weldcell::localize
