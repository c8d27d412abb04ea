#include "weldcell/workpiece/workpiece.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "weldcell/base/units.hpp"

namespace weldcell::workpiece {
namespace {

Workpiece one_bar() {
  Workpiece w;
  w.name = "bar";
  w.height_mm = 40;
  w.members.push_back({"m", "1", {{0, 0}, {100, 0}, {100, 10}, {0, 10}}, 0});
  return w;
}

std::string code(const Workpiece& w) {
  const auto result = validated(w);
  return result.ok() ? "ok" : result.error().code;
}

TEST(Validated, TurnsOutlinesCounterClockwiseAndDropsRepeats) {
  Workpiece w = one_bar();
  w.members[0].outline = {{0, 0}, {0, 10}, {0, 10}, {100, 10}, {100, 0}, {0, 0}};
  const auto result = validated(w);
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->members[0].outline.size(), 4u);
  EXPECT_DOUBLE_EQ(signed_area(result->members[0].outline), 1000);
}

TEST(Validated, NamesEachFault) {
  EXPECT_EQ(code(one_bar()), "ok");
  Workpiece w = one_bar();
  w.height_mm = 0;
  EXPECT_EQ(code(w), "workpiece.height");
  w = one_bar();
  w.name.clear();
  EXPECT_EQ(code(w), "workpiece.name");
  w = one_bar();
  w.members.push_back(w.members[0]);
  EXPECT_EQ(code(w), "workpiece.name");
  w = one_bar();
  w.members[0].outline.resize(2);
  EXPECT_EQ(code(w), "workpiece.outline");
  w = one_bar();
  w.members[0].outline = {{0, 0}, {100, 10}, {100, 0}, {0, 10}};
  EXPECT_NE(code(w), "ok") << "a bow tie";
  w = one_bar();
  w.members[0].outline = {{0, 0}, {100, 10}, {120, 0}, {0, 20}};
  EXPECT_EQ(code(w), "workpiece.outline") << "an unequal bow tie";
  w = one_bar();
  w.members[0].outline = {{0, 0}, {0.1, 0}, {0.1, 0.1}};
  EXPECT_EQ(code(w), "workpiece.area");
  w = one_bar();
  w.members[0].outline[0].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(code(w), "workpiece.outline");
  w = one_bar();
  w.members.clear();
  EXPECT_EQ(code(w), "workpiece.members");
  w = one_bar();
  w.welds.push_back({"w1", {"nobody"}, {0, 0, 0}, {{false, Eigen::Vector3d::Zero(), {1, 0, 0}}}, 0.6, 0, 0});
  EXPECT_EQ(code(w), "workpiece.joins");
  w.welds[0].joins = {"m"};
  EXPECT_EQ(code(w), "ok");
  w.welds[0].pieces.clear();
  EXPECT_EQ(code(w), "workpiece.path");
}

TEST(SamplePath, StraightPiecesKeepTheirEnds) {
  Weld weld;
  weld.start = {0, 0, 40};
  weld.pieces = {{false, Eigen::Vector3d::Zero(), {10, 0, 40}},
                 {false, Eigen::Vector3d::Zero(), {10, 5, 40}}};
  const auto points = sample_path(weld, 2);
  ASSERT_EQ(points.size(), 1u + 5u + 3u);
  EXPECT_EQ(points.front(), weld.start);
  EXPECT_EQ(points[5], weld.pieces[0].to);
  EXPECT_EQ(points.back(), weld.pieces[1].to);
  for (std::size_t i = 1; i < points.size(); ++i) EXPECT_LE((points[i] - points[i - 1]).norm(), 2 + 1e-9);
}

TEST(SamplePath, ArcRunsThroughItsViaPoint) {
  for (const double sign : {1.0, -1.0}) {
    Weld weld;
    weld.start = {10, 0, 5};
    // Three quarters of a circle of radius 10 about the origin.
    weld.pieces = {{true, {-10, 0, 5}, {0, -10 * sign, 5}}};
    const auto points = sample_path(weld, 0.5);
    double length = 0, closest_to_via = 1e9;
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_NEAR(points[i].head<2>().norm(), 10, 1e-9);
      EXPECT_NEAR(points[i].z(), 5, 1e-12);
      closest_to_via = std::min(closest_to_via, (points[i] - weld.pieces[0].via).norm());
      if (i > 0) length += (points[i] - points[i - 1]).norm();
    }
    EXPECT_NEAR(length, 15 * kPi, 0.05);
    EXPECT_LT(closest_to_via, 0.3);
    EXPECT_EQ(points.back(), weld.pieces[0].to);
  }
}

TEST(SamplePath, ThreePointsOnALineAreALine) {
  Weld weld;
  weld.pieces = {{true, {5, 0, 0}, {10, 0, 0}}};
  EXPECT_EQ(sample_path(weld, 1).size(), 11u);
}

}  // namespace
}  // namespace weldcell::workpiece
