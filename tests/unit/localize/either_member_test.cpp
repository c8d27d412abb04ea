// A rail that is pulled off the rest of a ladder: the scan may not tell which of the two rails it is.
#include <gtest/gtest.h>

#include <cmath>

#include "line_scan.hpp"
#include "weldcell/localize/localizer.hpp"

namespace weldcell::localize {
namespace {

using workpiece::OutlineTemplate;
using workpiece::Workpiece;

/// The upper rail off by so much at its left end and at its right end.
Workpiece ladder(double left_off_mm, double right_off_mm) {
  Workpiece w;
  w.name = "ladder";
  w.height_mm = 40;
  w.members = {box("rail_L", {-500, -250}, {500, -210}), box("rail_R", {-500, 210}, {500, 250})};
  for (Vec2& p : w.members[1].outline)
    p.y() += left_off_mm + (right_off_mm - left_off_mm) * (p.x() + 500) / 1000;
  for (const double x : {-420.0, -100.0, 60.0, 380.0})
    w.members.push_back(box("rung_" + std::to_string(w.members.size() - 1), {x, -210}, {x + 40, 210}));
  return *workpiece::validated(std::move(w));
}

Workpiece ladder(double upper_rail_off_mm) { return ladder(upper_rail_off_mm, upper_rail_off_mm); }

/// Lines so far apart both ways over what lies there, 0.2 mm noise, no clutter.
Scan scan_of(const OutlineTemplate& part, std::uint64_t seed, double pitch_mm = 30) {
  Scan out;
  std::vector<PathPiece> path;
  for (double at = -585; at < 600; at += pitch_mm) {
    const double to = std::lround((at + 585) / pitch_mm) % 2 == 0 ? 600 : -600;
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

TEST(EitherMember, ARailPulledOffUnevenlyIsToldByItsTurn) {
  const Localizer localizer(*workpiece::build_template(ladder(0)));
  LocalizeOptions options;
  options.max_member_shift_mm = 6;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto lies = workpiece::build_template(ladder(1.0, 4.5), 6.0);
    ASSERT_TRUE(lies.ok());
    const Scan scan = scan_of(*lies, seed);
    const Localization found = localizer.localize(scan.edges, scan.path, options);
    SCOPED_TRACE("seed " + std::to_string(seed) + ": " + found.reason);
    ASSERT_EQ(found.verdict, Verdict::Weld);
    EXPECT_NEAR(found.members[1].dy_mm, 2.75, 0.3);
    EXPECT_NEAR(found.members[1].dtheta_rad, 0.0035, 0.0005);
    EXPECT_NEAR(found.members[0].dy_mm, 0, 0.3);
  }
}

TEST(EitherMember, ARailOffAlongItselfByLittleIsFoundOrDoubted) {
  const Localizer localizer(*workpiece::build_template(ladder(0)));
  Workpiece lying = ladder(0);
  for (Vec2& p : lying.members[1].outline) p.x() += 0.7;
  const auto lies = workpiece::build_template(lying);
  ASSERT_TRUE(lies.ok());
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Scan scan = scan_of(*lies, seed, 10);
    const Localization found = localizer.localize(scan.edges, scan.path, {});
    SCOPED_TRACE("seed " + std::to_string(seed) + ": " + found.reason);
    const double sigma = std::sqrt(found.members[1].covariance(0, 0));
    EXPECT_LT(sigma, 0.2);
    EXPECT_NEAR(found.members[1].dx_mm, 0.7, 4 * sigma);
    EXPECT_NEAR(found.members[0].dx_mm, 0, 0.1);
  }
}

}  // namespace
}  // namespace weldcell::localize
