#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "edge_sets.hpp"
#include "weldcell/localize/localizer.hpp"

namespace weldcell::localize {
namespace {

const std::string kFolder = WELDCELL_TEST_DATA "/edges";

class Garbage : public ::testing::Test {
 protected:
  Garbage()
      : localizer_(*workpiece::build_template(testing::read_workpiece(kFolder, "ladder"))),
        set_(testing::read_set(kFolder, "ladder", "base", 0)) {}

  Localization run(const std::vector<EdgePoint>& edges) const {
    return localizer_.localize(edges, set_.path, {});
  }

  Localizer localizer_;
  testing::EdgeSet set_;
};

TEST_F(Garbage, NoPointsAreTooFew) {
  const Localization found = run({});
  EXPECT_EQ(found.verdict, Verdict::Rescan);
  EXPECT_EQ(found.cause, "too_few_points");
}

TEST_F(Garbage, PointsThatAreNoNumbersAreNamed) {
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), 1e300}) {
    auto edges = set_.edges;
    for (std::size_t i = 0; i < edges.size(); i += 3) edges[i].x_mm = bad;
    const Localization found = run(edges);
    EXPECT_EQ(found.verdict, Verdict::Reject);
    EXPECT_EQ(found.cause, "bad_points");
    EXPECT_EQ(found.edge_of_point.size(), edges.size());
  }
}

TEST_F(Garbage, AFewBrokenPointsDoNotMatter) {
  auto edges = set_.edges;
  edges[5].y_mm = std::nan("");
  edges[9].dir_x = std::numeric_limits<double>::infinity();
  const Localization found = run(edges);
  EXPECT_EQ(found.verdict, Verdict::Weld) << found.reason;
  EXPECT_EQ(found.edge_of_point[5], -1);
}

TEST_F(Garbage, NegativeAndBrokenSigmasAreReplaced) {
  auto edges = set_.edges;
  for (std::size_t i = 0; i < edges.size(); ++i) edges[i].sigma_mm = i % 2 == 0 ? -1 : std::nan("");
  const Localization found = run(edges);
  EXPECT_NEAR(found.pose.x_mm, set_.truth.x_mm, 0.3);
  EXPECT_NEAR(found.pose.y_mm, set_.truth.y_mm, 0.3);
}

TEST_F(Garbage, SigmasFarTooSmallAreNotBelieved) {
  auto edges = set_.edges;
  for (EdgePoint& e : edges) e.sigma_mm = 0.02;
  const Localization found = run(edges);
  EXPECT_NEAR(found.pose.x_mm, set_.truth.x_mm, 0.3);
  EXPECT_GT(std::sqrt(found.covariance(0, 0)), 0.015) << "the residuals say that 0.02 mm was wrong";
}

TEST_F(Garbage, APointSeenAThousandTimesCountsOnce) {
  auto edges = set_.edges;
  const Localization once = run(edges);
  edges.insert(edges.end(), 1000, edges[3]);
  const Localization many = run(edges);
  EXPECT_NEAR(once.pose.x_mm, many.pose.x_mm, 1e-9);
  EXPECT_NEAR(once.covariance(0, 0), many.covariance(0, 0), 1e-9);
}

TEST_F(Garbage, OneLineOfPointsIsNamedWhateverTheMethod) {
  for (const double turn : {0.0, 0.7, kPi / 2}) {
    std::vector<EdgePoint> edges;
    for (int i = 0; i < 60; ++i) {
      edges.push_back(
          {-30 + 10 * i * std::cos(turn), -25 + 10 * i * std::sin(turn), 0, 1, 1, 0.3, 200, false});
    }
    for (const Method method : {Method::Robust, Method::Paper}) {
      LocalizeOptions options;
      options.method = method;
      const Localization found = localizer_.localize(edges, set_.path, options);
      EXPECT_EQ(found.verdict, Verdict::Rescan);
      EXPECT_EQ(found.cause, "one_line") << found.reason;
    }
  }
}

TEST_F(Garbage, OneSpotIsOneLine) {
  std::vector<EdgePoint> edges;
  for (int i = 0; i < 60; ++i) edges.push_back({10 + 1e-3 * i, 5, 1, 0, 1, 0.3, 200, false});
  EXPECT_EQ(run(edges).cause, "one_line");
}

TEST_F(Garbage, OnePointManyTimesIsTooFew) {
  const Localization found = run(std::vector<EdgePoint>(1000, set_.edges[3]));
  EXPECT_EQ(found.verdict, Verdict::Rescan);
  EXPECT_EQ(found.cause, "too_few_points");
}

TEST_F(Garbage, ABrokenPathIsNamedAndAFewBrokenPiecesAreLeftOut) {
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), 1e300}) {
    auto path = set_.path;
    path[4].y1_mm = bad;
    const Localization one = localizer_.localize(set_.edges, path, {});
    EXPECT_EQ(one.verdict, Verdict::Weld) << one.reason;
    for (PathPiece& p : path) p.x0_mm = bad;
    const Localization all = localizer_.localize(set_.edges, path, {});
    EXPECT_EQ(all.verdict, Verdict::Reject);
    EXPECT_EQ(all.cause, "bad_path") << all.reason;
  }
}

TEST_F(Garbage, TwoParallelLinesAreNotEnough) {
  std::vector<EdgePoint> edges;
  for (int i = 0; i < 60; ++i) {
    edges.push_back({-300.0 + 10 * i, -250, 0, 1, 1, 0.3, 200, false});
    edges.push_back({-300.0 + 10 * i, -210, 0, 1, -1, 0.3, 200, false});
  }
  EXPECT_NE(localizer_.localize(edges, {}, {}).verdict, Verdict::Weld);
}

TEST_F(Garbage, OneEdgeOnlyIsNotEnough) {
  std::vector<EdgePoint> edges;
  for (int i = 0; i < 60; ++i) edges.push_back({-300.0 + 10 * i, -250, 0, 1, 1, 0.3, 200, false});
  const Localization found = localizer_.localize(edges, {}, {});
  EXPECT_NE(found.verdict, Verdict::Weld) << found.reason;
}

TEST_F(Garbage, ClutterAloneIsNeverWelded) {
  constexpr std::uint64_t kSeed = 4711;
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> place(-600, 600), angle(0, 2 * kPi);
  for (int trial = 0; trial < 40; ++trial) {
    std::vector<EdgePoint> edges;
    const int count = 6 + static_cast<int>(random() % 300);
    for (int i = 0; i < count; ++i) {
      const double a = angle(random);
      edges.push_back(
          {place(random), place(random), std::cos(a), std::sin(a), i % 2 == 0 ? 1 : -1, 0.3, 200, false});
    }
    const Localization found = run(edges);
    EXPECT_NE(found.verdict, Verdict::Weld) << "seed " << kSeed << " trial " << trial;
    EXPECT_FALSE(found.cause.empty());
    EXPECT_FALSE(found.reason.empty());
  }
}

TEST_F(Garbage, AMillionPointsEnd) {
  constexpr std::uint64_t kSeed = 815;
  std::mt19937_64 random(kSeed);
  std::normal_distribution<double> noise(0, 0.2);
  std::vector<EdgePoint> edges;
  while (edges.size() < 1'000'000) {
    for (const EdgePoint& e : set_.edges) {
      edges.push_back(e);
      edges.back().x_mm += noise(random);
      edges.back().y_mm += noise(random);
    }
  }
  const Localization found = run(edges);
  EXPECT_EQ(found.edge_of_point.size(), edges.size());
  EXPECT_NEAR(found.pose.x_mm, set_.truth.x_mm, 0.5);
}

TEST_F(Garbage, SenselessOptionsAreRefusedByName) {
  const std::vector<std::pair<std::string, double LocalizeOptions::*>> fields{
      {"range_mm", &LocalizeOptions::range_mm},
      {"range_rad", &LocalizeOptions::range_rad},
      {"max_offset_mm", &LocalizeOptions::max_offset_mm},
      {"max_rotation_rad", &LocalizeOptions::max_rotation_rad},
      {"max_member_shift_mm", &LocalizeOptions::max_member_shift_mm},
      {"max_mean_error_mm", &LocalizeOptions::max_mean_error_mm},
      {"latency_sigma_s", &LocalizeOptions::latency_sigma_s},
      {"inset_sigma_mm", &LocalizeOptions::inset_sigma_mm},
      {"member_shift_sigma_mm", &LocalizeOptions::member_shift_sigma_mm},
      {"member_angle_sigma_rad", &LocalizeOptions::member_angle_sigma_rad}};
  for (const auto& [name, field] : fields) {
    for (const double bad : {std::nan(""), -1.0, -std::numeric_limits<double>::infinity()}) {
      LocalizeOptions options;
      options.*field = bad;
      const Localization found = localizer_.localize(set_.edges, set_.path, options);
      EXPECT_EQ(found.verdict, Verdict::Reject);
      EXPECT_EQ(found.cause, "bad_options");
      EXPECT_NE(found.reason.find(name), std::string::npos) << found.reason;
    }
  }
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), 1e300}) {
    LocalizeOptions options;
    options.planned.x_mm = bad;
    const Localization found = localizer_.localize(set_.edges, set_.path, options);
    EXPECT_EQ(found.cause, "bad_options");
    EXPECT_NE(found.reason.find("planned.x_mm"), std::string::npos) << found.reason;
  }
}

TEST_F(Garbage, SigmasOfOptionsThatAreNearlyNothingHoldTheirTerm) {
  for (const double tiny : {0.0, 1e-320, 1e-200, 1e-9}) {
    LocalizeOptions options;
    options.latency_sigma_s = options.inset_sigma_mm = tiny;
    options.member_shift_sigma_mm = options.member_angle_sigma_rad = tiny;
    const Localization found = localizer_.localize(set_.edges, set_.path, options);
    EXPECT_NEAR(found.pose.x_mm, set_.truth.x_mm, 0.5) << tiny;
    EXPECT_TRUE(found.covariance.allFinite()) << tiny;
    EXPECT_GT(found.covariance(0, 0), 0) << tiny;
  }
}

TEST_F(Garbage, TheOrderOfThePointsDoesNotMatter) {
  auto edges = set_.edges;
  const Localization before = run(edges);
  std::reverse(edges.begin(), edges.end());
  const Localization after = run(edges);
  EXPECT_EQ(before.pose.x_mm, after.pose.x_mm);
  EXPECT_EQ(before.pose.theta_rad, after.pose.theta_rad);
  EXPECT_EQ(before.edge_of_point.front(), after.edge_of_point.back());
}

TEST_F(Garbage, APartOutsideTheRangeIsRefusedByName) {
  auto edges = set_.edges;
  auto path = set_.path;
  for (EdgePoint& e : edges) e.x_mm += 90;
  for (PathPiece& p : path) p.x0_mm += 90, p.x1_mm += 90;
  const Localization found = localizer_.localize(edges, path, {});
  EXPECT_EQ(found.verdict, Verdict::Reject);
  EXPECT_EQ(found.cause, "out_of_range") << found.reason;
}

TEST_F(Garbage, ThePaperMethodLeavesBrokenPointsOut) {
  LocalizeOptions options;
  options.method = Method::Paper;
  auto edges = set_.edges;
  edges[5].y_mm = std::nan("");
  edges[9].x_mm = 1e300;
  const Localization found = localizer_.localize(edges, {}, options);
  EXPECT_NEAR(found.pose.x_mm, set_.truth.x_mm, 0.5);
  EXPECT_EQ(found.edge_of_point.size(), edges.size());
  for (EdgePoint& e : edges) e.x_mm = std::nan("");
  EXPECT_EQ(localizer_.localize(edges, {}, options).cause, "bad_points");
  EXPECT_EQ(localizer_.localize({}, {}, options).cause, "too_few_points");
}

TEST_F(Garbage, ThePaperMethodFindsTheSamePlace) {
  LocalizeOptions options;
  options.method = Method::Paper;
  const Localization found = localizer_.localize(set_.edges, {}, options);
  EXPECT_NEAR(found.pose.x_mm, set_.truth.x_mm, 0.5);
  EXPECT_NEAR(found.pose.y_mm, set_.truth.y_mm, 0.5);
  EXPECT_NEAR(deg(found.pose.theta_rad - set_.truth.theta_rad), 0, 0.1);
  EXPECT_EQ(found.verdict == Verdict::Weld, found.mean_error_mm <= 2.5);
}

}  // namespace
}  // namespace weldcell::localize
