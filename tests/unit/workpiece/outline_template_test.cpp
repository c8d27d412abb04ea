#include "weldcell/workpiece/outline_template.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "weldcell/base/units.hpp"

namespace weldcell::workpiece {
namespace {

Member bar(const std::string& name, double x0, double y0, double x1, double y1) {
  return {name, name, {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}}, 0};
}

Workpiece of(std::vector<Member> members) {
  Workpiece w;
  w.name = "test";
  w.height_mm = 40;
  w.members = std::move(members);
  auto result = validated(w);
  EXPECT_TRUE(result.ok());
  return *result;
}

double total_length(const OutlineTemplate& t) {
  double sum = 0;
  for (const auto& edge : t.edges) sum += edge.line.length();
  return sum;
}

/// Every edge has material just inside it and table just outside it.
void expect_honest_edges(const OutlineTemplate& t) {
  for (const auto& edge : t.edges) {
    EXPECT_NEAR(edge.outward.norm(), 1, 1e-12);
    const Vec2 d = edge.line.direction();
    EXPECT_NEAR(d.x() * edge.outward.y() - d.y() * edge.outward.x(), -1, 1e-9) << "material lies to the left";
    for (const double share : {0.02, 0.5, 0.98}) {
      const Vec2 p = edge.line.a + share * (edge.line.b - edge.line.a);
      const auto covered = [&](const Vec2& q) {
        return std::any_of(t.members.begin(), t.members.end(),
                           [&](const Polygon& m) { return contains(m, q); });
      };
      EXPECT_TRUE(covered(p - 0.01 * edge.outward));
      EXPECT_FALSE(covered(p + 0.01 * edge.outward));
    }
  }
}

TEST(Template, OneBarShowsAllFourSides) {
  const auto t = build_template(of({bar("m", 0, 0, 100, 10)}));
  ASSERT_TRUE(t.ok());
  EXPECT_EQ(t->edges.size(), 4u);
  EXPECT_NEAR(total_length(*t), 220, 1e-9);
  EXPECT_NEAR((t->centroid - Vec2(50, 5)).norm(), 0, 1e-9);
  EXPECT_NEAR(t->radius_mm, std::hypot(50, 5), 1e-9);
  expect_honest_edges(*t);
}

TEST(Template, ButtJointHidesTheRungsEndAndItsPartOfTheRail) {
  const auto t = build_template(of({bar("rail", 0, 0, 100, 10), bar("rung", 40, 10, 50, 60)}));
  ASSERT_TRUE(t.ok());
  EXPECT_NEAR(total_length(*t), 220 - 10 + 120 - 10, 1e-6);
  EXPECT_EQ(t->edges.size(), 8u) << "the rail's top side falls into two";
  expect_honest_edges(*t);
}

TEST(Template, JointWithARootGapIsStillHidden) {
  const auto t = build_template(of({bar("rail", 0, 0, 100, 10), bar("rung", 40, 10.4, 50, 60)}));
  ASSERT_TRUE(t.ok());
  EXPECT_NEAR(total_length(*t), 220 - 10 + 2 * 49.6 + 10, 1.1);
  const auto open = build_template(of({bar("rail", 0, 0, 100, 10), bar("rung", 40, 11, 50, 60)}));
  EXPECT_NEAR(total_length(*open), 220 + 118, 1e-6) << "a gap of 1 mm can be seen";
}

TEST(Template, OverlapAndSharedSilhouetteAppearOnce) {
  // The rung lies on the rail and ends flush with its far side.
  const auto t = build_template(of({bar("rail", 0, 0, 100, 10), bar("rung", 40, 0, 50, 60)}));
  ASSERT_TRUE(t.ok());
  EXPECT_NEAR(total_length(*t), 220 - 10 + 100 + 10, 1e-6);
  expect_honest_edges(*t);
}

TEST(Template, MitredFrameShowsOnlyOuterAndInnerOutline) {
  const auto t = build_template(of({
      {"s", "1", {{0, 0}, {400, 0}, {360, 40}, {40, 40}}, 0},
      {"e", "2", {{400, 0}, {400, 300}, {360, 260}, {360, 40}}, 0},
      {"n", "3", {{400, 300}, {0, 300}, {40, 260}, {360, 260}}, 0},
      {"w", "4", {{0, 300}, {0, 0}, {40, 40}, {40, 260}}, 0},
  }));
  ASSERT_TRUE(t.ok());
  EXPECT_EQ(t->edges.size(), 8u);
  EXPECT_NEAR(total_length(*t), 1400 + 2 * (320 + 220), 0.01);
  expect_honest_edges(*t);
  ASSERT_EQ(t->symmetries.size(), 1u);
  EXPECT_EQ(t->symmetries[0].gap_mm, 0);
  EXPECT_NEAR(std::abs(t->symmetries[0].map.theta_rad), kPi, 1e-6);
  EXPECT_NEAR((t->symmetries[0].map * Vec2(0, 0) - Vec2(400, 300)).norm(), 0, 1e-3);
}

TEST(Template, SquareHasThreeSymmetries) {
  const auto t = build_template(of({bar("m", 0, 0, 300, 300)}));
  ASSERT_TRUE(t.ok());
  ASSERT_EQ(t->symmetries.size(), 3u);
  for (const auto& s : t->symmetries) EXPECT_EQ(s.gap_mm, 0);
}

TEST(Template, NearSymmetryIsFoundWithItsGap) {
  // A frame whose middle bar stands 5 mm beside the middle.
  const auto t = build_template(
      of({bar("s", -300, -300, 300, -260), bar("n", -300, 260, 300, 300), bar("w", -300, -260, -260, 260),
          bar("e", 260, -260, 300, 260), bar("mid", -17.5, -260, 22.5, 260)}));
  ASSERT_TRUE(t.ok());
  const auto half_turn = std::find_if(t->symmetries.begin(), t->symmetries.end(), [](const Symmetry& s) {
    return std::abs(wrap_pi(s.map.theta_rad - kPi)) < 0.02;
  });
  ASSERT_NE(half_turn, t->symmetries.end());
  EXPECT_GT(half_turn->gap_mm, 0.5);
  EXPECT_LT(half_turn->gap_mm, 5);
}

TEST(Template, AsymmetricPartHasNoTrueSymmetry) {
  const auto t = build_template(
      of({bar("rail", 0, 0, 600, 40), bar("post", 50, 40, 90, 400), bar("short", 400, 40, 440, 160)}));
  ASSERT_TRUE(t.ok());
  for (const auto& s : t->symmetries) EXPECT_GT(s.gap_mm, 1);
}

TEST(Template, RoundEdgesRunAlongTheLongSidesOnly) {
  Workpiece w = of({bar("m", 0, 0, 100, 10)});
  w.members[0].edge_radius_mm = 2;
  const auto t = build_template(w);
  ASSERT_TRUE(t.ok());
  for (const auto& edge : t->edges) EXPECT_EQ(edge.round, edge.line.length() > 50);
}

}  // namespace
}  // namespace weldcell::workpiece
