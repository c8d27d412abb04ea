// A rail that is pulled off the rest of a ladder: the scan may not tell which of the two rails it is.
#include <gtest/gtest.h>

#include <cmath>

#include "line_scan.hpp"
#include "weldcell/localize/localizer.hpp"

namespace weldcell::localize {
namespace {

using workpiece::OutlineTemplate;
using workpiece::Workpiece;

Workpiece ladder(double upper_rail_off_mm) {
  Workpiece w;
  w.name = "ladder";
  w.height_mm = 40;
  w.members = {box("rail_L", {-500, -250}, {500, -210}),
               box("rail_R", {-500, 210 + upper_rail_off_mm}, {500, 250 + upper_rail_off_mm})};
  for (const double x : {-420.0, -100.0, 60.0, 380.0})
    w.members.push_back(box("rung_" + std::to_string(w.members.size() - 1), {x, -210}, {x + 40, 210}));
  return *workpiece::validated(std::move(w));
}

/// Lines 30 mm apart both ways over what lies there, 0.2 mm noise, no clutter.
Scan scan_of(const OutlineTemplate& part, std::uint64_t seed) {
  Scan out;
  std::vector<PathPiece> path;
  for (double at = -585; at < 600; at += 30) {
    const double to = std::lround((at + 585) / 30) % 2 == 0 ? 600 : -600;
    path.push_back({-to, at, to, at});
    path.push_back({at, -to, at, to});
  }
  scan(part, path, seed, out);
  return out;
}

TEST(EitherMember, APoseThatHangsOnWhichRailIsOffIsNotWelded) {
  const Localizer localizer(*workpiece::build_template(ladder(0)));
  int doubted = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    // Both sides of a slot narrower than 6 mm stay unseen, so that nothing tells which rail has moved.
    const auto lies = workpiece::build_template(ladder(2.4), 6.0);
    ASSERT_TRUE(lies.ok());
    const Scan scan = scan_of(*lies, seed);
    const Localization found = localizer.localize(scan.edges, scan.path, {});
    SCOPED_TRACE("seed " + std::to_string(seed) + ": " + found.reason);
    if (found.verdict == Verdict::Weld) {
      EXPECT_LT(std::hypot(found.pose.x_mm, found.pose.y_mm), 1.0);
      continue;
    }
    ++doubted;
    EXPECT_EQ(found.cause, "not_enough");
    EXPECT_NE(found.reason.find("rail_L"), std::string::npos);
    EXPECT_NE(found.reason.find("rail_R"), std::string::npos);
    // The spread between the two readings is in the covariance.
    EXPECT_LT(std::abs(found.pose.y_mm), 4 * std::sqrt(found.covariance(1, 1)));
  }
  EXPECT_GE(doubted, 10);
}

TEST(EitherMember, AnOpenJointThatWasSeenTellsWhichRail) {
  const Localizer localizer(*workpiece::build_template(ladder(0)));
  LocalizeOptions options;
  options.max_member_shift_mm = 6;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto lies = workpiece::build_template(ladder(2.4), 0.5);
    ASSERT_TRUE(lies.ok());
    const Scan scan = scan_of(*lies, seed);
    const Localization found = localizer.localize(scan.edges, scan.path, options);
    SCOPED_TRACE("seed " + std::to_string(seed) + ": " + found.reason);
    ASSERT_EQ(found.verdict, Verdict::Weld);
    EXPECT_NEAR(found.pose.y_mm, 0, 0.3);
    EXPECT_NEAR(found.members[1].dy_mm, 2.4, 0.3);
    EXPECT_NEAR(found.members[0].dy_mm, 0, 0.3);
  }
}

}  // namespace
}  // namespace weldcell::localize
