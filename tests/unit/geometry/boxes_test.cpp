#include "weldcell/geometry/boxes.hpp"

#include <gtest/gtest.h>

#include <random>

namespace weldcell {
namespace {

const Box2 kUnit{{0, 0}, {1, 1}};

TEST(Boxes, ThatTouchAreNotApart) {
  EXPECT_FALSE(apart(kUnit, {{1, 1}, {2, 2}}));
  EXPECT_TRUE(apart(kUnit, {{1.1, 0}, {2, 1}}));
  EXPECT_TRUE(apart({{0, 2}, {1, 3}}, kUnit));
  EXPECT_FALSE(apart(grown(kUnit, 0.1), {{1.1, 0}, {2, 1}}));
}

TEST(Boxes, HoldWhatTheyAreMadeOf) {
  const Box2 all = united(kUnit, {{3, -2}, {4, 0.5}});
  EXPECT_EQ(all.min, Vec2(0, -2));
  EXPECT_EQ(all.max, Vec2(4, 1));
  const Box2 shared = intersection(kUnit, {{0.5, -1}, {2, 0.25}});
  EXPECT_EQ(shared.min, Vec2(0.5, 0));
  EXPECT_EQ(shared.max, Vec2(1, 0.25));
  EXPECT_TRUE(contains(shared, Vec2(1, 0.25)));
  EXPECT_FALSE(contains(shared, Vec2(0.4, 0.1)));
}

TEST(Boxes, MeetASegmentThatHasAPointInThem) {
  std::mt19937_64 random(20261127);
  std::uniform_real_distribution<double> at(-2, 3);
  int met = 0;
  for (int i = 0; i < 2'000; ++i) {
    const Segment s{{at(random), at(random)}, {at(random), at(random)}};
    double beside = 1e9;  // how far beside the box the nearest of many points lies
    for (int k = 0; k <= 1'000; ++k) {
      const Vec2 p = s.a + k / 1e3 * (s.b - s.a);
      beside = std::min(beside, (p - p.cwiseMax(kUnit.min).cwiseMin(kUnit.max)).norm());
    }
    if (beside > 0 && beside < 0.01) continue;  // between two of the points
    EXPECT_EQ(meets(s, kUnit), beside == 0) << s.a.transpose() << " to " << s.b.transpose();
    met += beside == 0;
  }
  EXPECT_GT(met, 300);
}

}  // namespace
}  // namespace weldcell
