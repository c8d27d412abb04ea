#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "cad/dxf_drawing.hpp"
#include "cad/outline.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::cad {
namespace {

std::vector<Segment> sides(const Polygon& p) {
  std::vector<Segment> out;
  for (std::size_t i = 0; i < p.size(); ++i) out.push_back({p[i], p[(i + 1) % p.size()]});
  return out;
}

Polygon box(double x0, double y0, double x1, double y1) { return {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}}; }

TEST(OuterBoundary, IsTheUnionOfTouchingAndCrossingSheets) {
  std::vector<Segment> all = sides(box(0, 0, 100, 20));
  for (const Segment& s : sides(box(40, 20, 60, 80))) all.push_back(s);   // stands on the first
  for (const Segment& s : sides(box(50, 70, 120, 90))) all.push_back(s);  // crosses the second
  for (const Segment& s : sides(box(10, 5, 30, 15))) all.push_back(s);    // lies inside the first
  const auto outline = outer_boundary(all);
  ASSERT_TRUE(outline.has_value());
  EXPECT_NEAR(signed_area(*outline), 100 * 20 + 20 * 60 + 70 * 20 - 10 * 10, 1e-6);
  EXPECT_EQ(straightened(*outline).size(), 12u);
}

TEST(OuterBoundary, LeavesDanglingLinesOut) {
  std::vector<Segment> all = sides(box(0, 0, 10, 10));
  all.push_back({{10, 10}, {15, 15}});
  all.push_back({{0, 5}, {-5, 5}});
  const auto outline = outer_boundary(all);
  ASSERT_TRUE(outline.has_value());
  EXPECT_NEAR(signed_area(*outline), 100, 1e-9);
  EXPECT_FALSE(outer_boundary({{{0, 0}, {1, 0}}, {{1, 0}, {1, 1}}}).has_value());
  EXPECT_FALSE(outer_boundary({}).has_value());
}

/// A grid's union is its hull, whatever turn it has and in whatever order its lines come.
TEST(OuterBoundary, OfTurnedGridsIsTheirHull) {
  constexpr unsigned kSeed = 3;
  std::mt19937 random(kSeed);
  for (int round = 0; round < 60; ++round) {
    SCOPED_TRACE("seed " + std::to_string(kSeed) + " round " + std::to_string(round));
    const double turn = std::uniform_real_distribution<double>(-3, 3)(random);
    const int nx = 1 + static_cast<int>(random() % 4), ny = 1 + static_cast<int>(random() % 4);
    const Pose2 pose{17, -5, turn};
    std::vector<Segment> all;
    for (int i = 0; i < nx; ++i) {
      for (int k = 0; k < ny; ++k) {
        for (const Segment& s : sides(box(10 * i, 7 * k, 10 * i + 10, 7 * k + 7)))
          all.push_back({pose * s.a, pose * s.b});
      }
    }
    std::shuffle(all.begin(), all.end(), random);
    const auto outline = outer_boundary(all);
    ASSERT_TRUE(outline.has_value());
    EXPECT_NEAR(signed_area(*outline), 70.0 * nx * ny, 1e-3);
    EXPECT_EQ(straightened(*outline).size(), 4u);
  }
}

TEST(Straightened, KeepsCornersThatHavePointsCloseBy) {
  Polygon p{{0, 0}, {1199, 0}, {1200, 0}, {1200, 0.004818}, {1200, 0.02}, {1200, 40}, {0, 40}, {0, 39.995}};
  const Polygon s = straightened(p);
  ASSERT_EQ(s.size(), 4u);
  EXPECT_NEAR(signed_area(s), 48000, 1e-6);
}

TEST(Widened, MovesTheLongSidesOnly) {
  EXPECT_NEAR(signed_area(widened(box(0, 4, 1200, 36), 4)), 1200 * 40, 1e-6);
  const Polygon mitre{{36, 36}, {4, 4}, {796, 4}, {764, 36}};
  const Polygon w = widened(mitre, 4);
  const Box2 b = bounds(w);
  EXPECT_NEAR(b.min.x(), 0, 1e-9);
  EXPECT_NEAR(b.max.x(), 800, 1e-9);
  EXPECT_NEAR(b.min.y(), 0, 1e-9);
  EXPECT_NEAR(b.max.y(), 40, 1e-9);
  EXPECT_NEAR(signed_area(w), (800 + 720) / 2.0 * 40, 1e-6);
}

TEST(Contact, IsTheSharedStretchAsOneLine) {
  const auto butt = contact_lines(box(0, 0, 1200, 40), box(380, 40.2, 420, 560), 0.5, 5);
  ASSERT_EQ(butt.size(), 1u);
  EXPECT_LT((butt[0].front() - Vec2(380, 40.1)).norm(), 1e-9);
  EXPECT_LT((butt[0].back() - Vec2(420, 40.1)).norm(), 1e-9);
  EXPECT_TRUE(contact_lines(box(0, 0, 1200, 40), box(380, 41, 420, 560), 0.5, 5).empty());
  EXPECT_TRUE(contact_lines(box(0, 0, 1200, 40), box(1197, 40, 1300, 560), 0.5, 5).empty());
  const Polygon a{{0, 0}, {800, 0}, {760, 40}, {40, 40}}, b{{0, 0}, {40, 40}, {40, 460}, {0, 500}};
  const auto mitre = contact_lines(a, b, 0.5, 5);
  ASSERT_EQ(mitre.size(), 1u);
  EXPECT_NEAR((mitre[0].front() - mitre[0].back()).norm(), 40 * std::sqrt(2), 1e-9);
}

TEST(Contact, FollowsACurve) {
  Polygon disc, socket;
  for (const Vec2& p : arc_points({0, 0}, 100, 0, 2 * kPi)) disc.push_back(p);
  disc.pop_back();
  for (const Vec2& p : arc_points({0, 0}, 100, 0, kPi)) socket.push_back(p);
  socket.push_back({-150, 0});
  socket.push_back({-150, 150});
  socket.push_back({150, 150});
  socket.push_back({150, 0});
  const auto lines = contact_lines(disc, socket, 0.5, 5);
  ASSERT_EQ(lines.size(), 1u);
  double length = 0;
  for (std::size_t i = 1; i < lines[0].size(); ++i) length += (lines[0][i] - lines[0][i - 1]).norm();
  EXPECT_NEAR(length, 100 * kPi, 1);
}

TEST(Overlap, IsDepthNotTouch) {
  EXPECT_NEAR(overlap_depth(box(0, 0, 100, 40), box(30, 40, 70, 200)), 0, 1e-9);
  EXPECT_NEAR(overlap_depth(box(0, 0, 100, 40), box(30, 37, 70, 200)), 3, 1e-9);
  EXPECT_NEAR(overlap_depth(box(0, 0, 100, 40), box(30, -50, 70, 200)), 20, 1e-9);
}

TEST(Curves, BulgeIsTheTangentOfAQuarterOfTheAngle) {
  const auto half =
      bulge_points({0, 0}, {10, 0}, 1);  // half circle to the right of travel's left: below for bulge > 0
  double lowest = 0;
  for (const Vec2& p : half) {
    EXPECT_NEAR((p - Vec2(5, 0)).norm(), 5, 1e-9);
    lowest = std::min(lowest, p.y());
  }
  EXPECT_NEAR(lowest, -5, 0.01);
  const auto quarter = bulge_points({100, 100}, {140, 140}, std::tan(kPi / 8));
  for (const Vec2& p : quarter) EXPECT_NEAR((p - Vec2(100, 140)).norm(), 40, 1e-6);
  EXPECT_EQ(bulge_points({0, 0}, {1, 0}, 0).size(), 1u);
  EXPECT_LT((half.back() - Vec2(10, 0)).norm(), 1e-12);
}

TEST(Curves, SplinesAreEvaluatedByTheirKnots) {
  const double w = std::sqrt(0.5);  // a quarter circle as a rational quadratic
  const auto quarter = spline_points(2, {0, 0, 0, 1, 1, 1}, {{10, 0}, {10, 10}, {0, 10}}, {1, w, 1});
  ASSERT_GT(quarter.size(), 8u);
  for (const Vec2& p : quarter) EXPECT_NEAR(p.norm(), 10, 1e-9);
  const auto line = spline_points(1, {0, 0, 1, 2, 2}, {{0, 0}, {5, 5}, {10, 0}}, {1, 1, 1});
  EXPECT_LT((line.back() - Vec2(10, 0)).norm(), 1e-12);
  EXPECT_TRUE(spline_points(3, {0, 0, 1, 1}, {{0, 0}, {1, 1}}, {1, 1}).empty());
  EXPECT_TRUE(spline_points(1, {0, 0, 2, 1, 1}, {{0, 0}, {5, 5}, {10, 0}}, {1, 1, 1}).empty());
}

}  // namespace
}  // namespace weldcell::cad
