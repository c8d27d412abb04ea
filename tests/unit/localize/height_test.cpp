#include "weldcell/localize/height.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <vector>

#include "line_scan.hpp"
#include "weldcell/base/units.hpp"

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

/// A frame of bars, 60 high, turned with its table about a place in the plane of its top. Where a beam along
/// Base z steps down from an edge of it: half-way between the last of the top and the first of the table.
class Leaning {
 public:
  Leaning(const Vec2& pivot, double roll_rad, double pitch_rad)
      : pivot_(pivot.x(), pivot.y(), kHeight_mm),
        turn_(Eigen::AngleAxisd(pitch_rad, Eigen::Vector3d::UnitY()) *
              Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX())) {}

  static constexpr double kHeight_mm = 60;

  Eigen::Vector3d turned(const Vec2& at, double z) const {
    return pivot_ + turn_ * (Eigen::Vector3d(at.x(), at.y(), z) - pivot_);
  }
  Vec2 step(const Vec2& on_edge, const Vec2& outward) const {
    const Vec2 top = turned(on_edge, kHeight_mm).head<2>(), foot = turned(on_edge, 0).head<2>();
    const double wall = (foot - top).dot(outward);
    return top + std::max(0.0, wall) / 2 * outward;
  }

 private:
  Eigen::Vector3d pivot_;
  Eigen::Matrix3d turn_;
};

TEST(Height, ALeaningPartIsFoundWhereItsTopLies) {
  workpiece::Workpiece w;
  w.name = "frame";
  w.height_mm = Leaning::kHeight_mm;
  w.members = {box("low", {0, 0}, {700, 50}), box("high", {0, 450}, {700, 500}),
               box("left", {100, 50}, {150, 450}), box("right", {500, 50}, {550, 450})};
  const auto part = workpiece::build_template(*workpiece::validated(std::move(w)));
  ASSERT_TRUE(part.ok());
  const Localizer localizer(*part);
  const Pose2 truth{4, -3, rad(0.4)};
  for (const auto& [roll, pitch] : {std::pair{0.3, 0.0}, {0.0, -0.3}, {-0.25, 0.2}, {0.0, 0.0}}) {
    SCOPED_TRACE(testing::Message() << "roll " << roll << " pitch " << pitch);
    const Leaning leaning(truth * part->centroid, rad(roll), rad(pitch));
    std::vector<EdgePoint> edges;
    std::vector<double> top_z, table_z;
    for (const workpiece::VisibleEdge& e : part->edges) {
      const Vec2 n = truth.rotate(e.outward);
      for (double at = 15; at < e.line.length() - 10; at += 35) {
        const Vec2 on_edge = truth * Vec2(e.line.a + at * e.line.direction());
        const Vec2 seen = leaning.step(on_edge, n);
        edges.push_back({seen.x(), seen.y(), n.x(), n.y(), -1, 0.05, 200, false});
        top_z.push_back(leaning.turned(on_edge, Leaning::kHeight_mm).z());
        table_z.push_back(leaning.turned(on_edge, 0).z());
      }
    }
    const Localization as_seen = localizer.localize(edges, {}, {});
    const LeaningFit fit = localize_leaning(localizer, edges, top_z, table_z, {}, {});
    const Vec2 there = truth * part->centroid;
    const double lean = Leaning::kHeight_mm * std::hypot(rad(roll), rad(pitch));
    // A quarter of the lean: half of the wall's width at one side of every member, nothing at the other.
    EXPECT_NEAR((as_seen.centroid_base - there).norm(), lean / 4, 0.02 * lean + 1e-3);
    EXPECT_LT((fit.found.centroid_base - there).norm(), 0.02 * lean + 1e-3);
    EXPECT_EQ(fit.found.verdict, Verdict::Weld) << fit.found.reason;
    EXPECT_GE(fit.found.covariance(0, 0) + 1e-12, as_seen.covariance(0, 0) * 0.5);
    ASSERT_TRUE(fit.heights.top.has_value());
    EXPECT_NEAR(fit.heights.top->slope_y, std::tan(rad(roll)), 1e-4);
  }
}

TEST(Height, AShadowedStepAndAStrayPointStayWhereTheyAre) {
  workpiece::Workpiece w;
  w.name = "bar";
  w.height_mm = 40;
  w.members = {box("bar", {0, 0}, {300, 50})};
  const auto part = workpiece::build_template(*workpiece::validated(std::move(w)));
  ASSERT_TRUE(part.ok());
  int top_side = -1, low_side = -1;
  for (std::size_t e = 0; e < part->edges.size(); ++e) {
    if (part->edges[e].outward.y() > 0.9) top_side = static_cast<int>(e);
    if (part->edges[e].outward.y() < -0.9) low_side = static_cast<int>(e);
  }
  TiltedPlane top;
  top.slope_y = 0.005;
  Localization found;
  found.edge_of_point = {top_side, low_side, top_side, -1};
  std::vector<EdgePoint> edges(4, EdgePoint{100, 50, 0, 1, -1, 0.05, 200, false});
  edges[2].shadowed = true;
  const std::vector<EdgePoint> out = upright(edges, found, *part, top);
  EXPECT_NEAR(out[0].y_mm, 50 - 40 * 0.005 / 2, 1e-9) << "the wall shows";
  for (const std::size_t same : {1, 2, 3}) EXPECT_NEAR(out[same].y_mm, 50, 1e-9) << same;
}

}  // namespace
}  // namespace weldcell::localize
