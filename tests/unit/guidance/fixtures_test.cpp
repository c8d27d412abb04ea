#include <gtest/gtest.h>

#include <cstdio>
#include <map>
#include <random>

#include "frame.hpp"
#include "weldcell/guidance/drawing.hpp"

namespace weldcell::guidance {
namespace {

using workpiece::Fixture;
using workpiece::Workpiece;

double boundary_distance(const Polygon& outline, const Vec2& p) {
  double nearest = 1e300;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    nearest = std::min(nearest, distance(p, Segment{outline[i], outline[(i + 1) % outline.size()]}));
  }
  return nearest;
}

/// What the paper asks of its magnets: on the outer boundary, along the axis, in nobody's way.
void expect_sound(const Workpiece& w, const std::vector<Fixture>& fixtures, int at_least) {
  std::map<std::string, int> count;
  for (const Fixture& f : fixtures) {
    const Vec2 centre(f.x_mm, f.y_mm);
    ++count[f.member];
    for (const auto& m : w.members) {
      EXPECT_FALSE(contains(m.outline, centre)) << f.member << " in " << m.name;
      const double gap = boundary_distance(m.outline, centre) - f.diameter_mm / 2;
      if (m.name == f.member) {
        EXPECT_NEAR(gap, 0, 1e-6) << f.member;
      } else {
        EXPECT_GE(gap, 1.9) << f.member << " at " << m.name;
      }
    }
    for (const Fixture& g : fixtures) {
      if (&g == &f) continue;
      EXPECT_GE((Vec2(g.x_mm, g.y_mm) - centre).norm(), (f.diameter_mm + g.diameter_mm) / 2);
    }
  }
  for (const auto& m : w.members) EXPECT_GE(count[m.name], at_least) << m.name;
}

TEST(Fixtures, HoldEveryMemberOfALadder) {
  const auto w = test::ladder();
  const auto fixtures = place_fixtures(w);
  expect_sound(w, fixtures, 2);
  // A rail ends free: a third magnet stops it lengthwise; a rung stands between the rails and needs none.
  int of_rail = 0, of_rung = 0;
  for (const Fixture& f : fixtures) {
    of_rail += f.member == "rail_A";
    of_rung += f.member == "rung_1";
  }
  EXPECT_EQ(of_rail, 3);
  EXPECT_EQ(of_rung, 2);
}

TEST(Fixtures, HoldEverySideOfAMitredFrame) { expect_sound(test::mitre(), place_fixtures(test::mitre()), 2); }

TEST(Fixtures, OfTheDrawingAreKept) {
  auto w = test::ladder();
  w.fixtures = {{-20, 20, 40, "rail_A"}};
  ASSERT_EQ(place_fixtures(w).size(), 1u);
  EXPECT_EQ(place_fixtures(w)[0].x_mm, -20);
}

TEST(Fixtures, HoldRandomLadders) {
  constexpr std::uint64_t kSeed = 20281;
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> size(0, 1);
  for (int trial = 0; trial < 100; ++trial) {
    const double width = 30 + 40 * size(random), long_mm = 500 + 900 * size(random),
                 tall = 300 + 400 * size(random);
    const int rungs = 2 + static_cast<int>(3 * size(random));
    Workpiece w;
    w.height_mm = 40;
    w.members = {test::rectangle("a", "1", 0, 0, long_mm, width),
                 test::rectangle("b", "2", 0, width + tall, long_mm, 2 * width + tall)};
    for (int r = 0; r < rungs; ++r) {
      const double x = r * (long_mm - width) / (rungs - 1);
      w.members.push_back(test::rectangle("r" + std::to_string(r), "", x, width, x + width, width + tall));
    }
    SCOPED_TRACE(::testing::Message() << "trial " << trial << " width " << width << " long " << long_mm
                                      << " tall " << tall << " rungs " << rungs);
    expect_sound(w, place_fixtures(w), 2);
  }
}

TEST(GuideSteps, NameNumberAndPlaceEachMemberInOrder) {
  const auto steps = guide_steps(test::ladder(), {900, 10, rad(90)});
  ASSERT_EQ(steps.size(), 4u);
  EXPECT_EQ(steps[2].title, "Place member 3: rung_1");
  EXPECT_LT((steps[0].centre_base_mm - Vec2(880, 210)).norm(), 1e-9);
  EXPECT_NEAR(std::abs(std::sin(steps[0].heading_rad)), 1, 1e-9);
  EXPECT_GE(steps[3].fixtures.size(), 2u);
  for (const Fixture& f : steps[3].fixtures) EXPECT_EQ(f.member, "rung_2");
}

}  // namespace
}  // namespace weldcell::guidance
