#include "weldcell/geometry/plane.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <random>

#include "weldcell/base/units.hpp"

namespace weldcell {
namespace {

Pose2 random_pose(std::mt19937_64& random) {
  std::uniform_real_distribution<double> place(-1000, 1000), turn(-kPi, kPi);
  return {place(random), place(random), turn(random)};
}

TEST(Pose2, ObeysTheLawsOfAGroup) {
  constexpr std::uint64_t kSeed = 20261;
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  std::mt19937_64 random(kSeed);
  for (int i = 0; i < 1000; ++i) {
    const Pose2 a = random_pose(random), b = random_pose(random), c = random_pose(random);
    const Vec2 p = random_pose(random).translation();
    EXPECT_LT((((a * b) * c) * p - (a * (b * (c * p)))).norm(), 1e-8);
    EXPECT_LT(((a * a.inverse()) * p - p).norm(), 1e-8);
    EXPECT_LT(((a.inverse() * a) * p - p).norm(), 1e-8);
    EXPECT_LE(std::abs((a * b).theta_rad), kPi);
  }
}

TEST(Pose2, AgreesWithTheSpatialTransform) {
  const Pose2 pose{900, -50, rad(30)};
  const Point<Base> p = part_on_table(pose, 500) * Point<Part>{{100, 20, 40}};
  EXPECT_LT((p.mm.head<2>() - pose * Vec2(100, 20)).norm(), 1e-12);
  EXPECT_DOUBLE_EQ(p.mm.z(), 540);
}

TEST(WrapPi, StaysInTheHalfOpenTurn) {
  EXPECT_DOUBLE_EQ(wrap_pi(kPi), kPi);
  EXPECT_DOUBLE_EQ(wrap_pi(-kPi), kPi);
  EXPECT_NEAR(wrap_pi(rad(350)), rad(-10), 1e-12);
}

TEST(Polygon, KnowsAreaCentroidAndInside) {
  const Polygon l{{0, 0}, {30, 0}, {30, 10}, {10, 10}, {10, 30}, {0, 30}};
  EXPECT_DOUBLE_EQ(signed_area(l), 500);
  EXPECT_LT((centroid(l) - Vec2(11, 11)).norm(), 1e-12);
  EXPECT_TRUE(contains(l, {5, 25}));
  EXPECT_TRUE(contains(l, {30, 5}));
  EXPECT_FALSE(contains(l, {20, 20}));
  EXPECT_DOUBLE_EQ(distance(Vec2(15, 15), Segment{{10, 10}, {10, 30}}), 5);
}

}  // namespace
}  // namespace weldcell
