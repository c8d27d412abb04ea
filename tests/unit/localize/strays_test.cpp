#include <gtest/gtest.h>

#include <algorithm>

#include "edge_sets.hpp"
#include "weldcell/localize/localizer.hpp"

namespace weldcell::localize {
namespace {

/// The rectangle of the development sets: its points, and points set down where no line of the scan passes.
class Strays : public ::testing::Test {
 protected:
  Strays()
      : localizer_(*workpiece::build_template(testing::read_workpiece(kFolder, "rect"))),
        set_(testing::read_set(kFolder, "rect", "base", 0)) {}

  static inline const std::string kFolder = WELDCELL_TEST_DATA "/edges";
  Localizer localizer_;
  testing::EdgeSet set_;
};

TEST_F(Strays, AnEdgePointBesideTheTravelIsNoneOfThisScan) {
  const Localization before = localizer_.localize(set_.edges, set_.path, {});
  ASSERT_EQ(before.verdict, Verdict::Weld) << before.reason;
  // Copies of points of the part, shifted square to their own line by a fifth of the lines' distance: as many
  // again, all on an outline that is not there.
  auto edges = set_.edges;
  for (const EdgePoint& e : set_.edges) {
    EdgePoint stray = e;
    stray.x_mm -= 8 * e.dir_y;
    stray.y_mm += 8 * e.dir_x;
    edges.push_back(stray);
  }
  const Localization found = localizer_.localize(edges, set_.path, {});
  EXPECT_EQ(found.verdict, Verdict::Weld) << found.reason;
  EXPECT_EQ(found.inliers, before.inliers);
  EXPECT_NEAR(found.pose.x_mm, before.pose.x_mm, 1e-9);
  EXPECT_NEAR(found.pose.theta_rad, before.pose.theta_rad, 1e-12);
  const auto first_stray = found.edge_of_point.begin() + static_cast<std::ptrdiff_t>(set_.edges.size());
  EXPECT_TRUE(std::all_of(first_stray, found.edge_of_point.end(), [](int e) { return e == -1; }));
}

TEST_F(Strays, APointSeenAcrossTheTravelIsNoneOfThisScan) {
  auto edges = set_.edges;
  for (const EdgePoint& e : set_.edges) {
    EdgePoint across = e;
    across.x_mm += 4 * e.dir_x;
    across.y_mm += 4 * e.dir_y;
    across.dir_x = -e.dir_y;
    across.dir_y = e.dir_x;
    edges.push_back(across);
  }
  const Localization found = localizer_.localize(edges, set_.path, {});
  EXPECT_EQ(found.verdict, Verdict::Weld) << found.reason;
  EXPECT_LT(found.inliers, static_cast<int>(set_.edges.size()) + 12);
}

TEST_F(Strays, APathInAnotherFrameIsNamed) {
  auto path = set_.path;
  for (PathPiece& p : path) p = {p.x0_mm + 2000, p.y0_mm, p.x1_mm + 2000, p.y1_mm};
  const Localization found = localizer_.localize(set_.edges, path, {});
  EXPECT_EQ(found.verdict, Verdict::Reject);
  EXPECT_EQ(found.cause, "bad_path");
  EXPECT_NE(found.reason.find("127 of 127 edge points do not lie on the scan path"), std::string::npos)
      << found.reason;
}

TEST_F(Strays, PointsWithoutADirectionAndTheOtherWayRoundStay) {
  auto edges = set_.edges;
  for (std::size_t i = 0; i < edges.size(); i += 2) edges[i].dir_x = edges[i].dir_y = 0;
  auto path = set_.path;
  for (PathPiece& p : path) p = {p.x1_mm, p.y1_mm, p.x0_mm, p.y0_mm};
  const Localization before = localizer_.localize(set_.edges, set_.path, {});
  const Localization found = localizer_.localize(edges, path, {});
  EXPECT_GE(found.inliers, before.inliers);
}

}  // namespace
}  // namespace weldcell::localize
