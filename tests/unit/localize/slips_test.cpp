// A part of many rungs at nearly one pitch: the search must not have it off by a rung.
#include <gtest/gtest.h>

#include <cmath>

#include "line_scan.hpp"
#include "localize/slips.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/localize/localizer.hpp"

namespace weldcell::localize {
namespace {

using workpiece::OutlineTemplate;
using workpiece::Workpiece;

/// Rungs 8 mm wide between two rails, the pitch uneven by some 2 mm.
OutlineTemplate comb(int rungs, double pitch_mm) {
  Workpiece w;
  w.name = "comb";
  w.height_mm = 40;
  const double half = rungs * pitch_mm / 2;
  w.members = {box("rail_L", {-half, -212}, {half, -200}), box("rail_R", {-half, 200}, {half, 212})};
  for (int i = 0; i < rungs; ++i) {
    const double x = -half + pitch_mm * (i + 0.5) + 5 * std::sin(0.42 * i);
    w.members.push_back(box("rung_" + std::to_string(i), {x - 4, -200}, {x + 4, 200}));
  }
  return *workpiece::build_template(*workpiece::validated(std::move(w)));
}

TEST(Slips, AnEvenPitchIsFoundAndAWideOneIsNone) {
  const std::vector<Vec2> slips = slips_of(TemplateFields(comb(98, 18)));
  ASSERT_EQ(slips.size(), 1u);
  EXPECT_NEAR(std::abs(slips.front().x()), 18, 1);
  EXPECT_NEAR(slips.front().y(), 0, 0.1);
  EXPECT_TRUE(slips_of(TemplateFields(comb(6, 200))).empty());
}

TEST(Slips, APartOfManyRungsIsFoundWhereItLies) {
  const Localizer localizer(comb(98, 18));
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Scan seen;
    std::vector<PathPiece> path;
    const double first = -960 + 3.0 * static_cast<double>(seed);
    for (double at = first; at < 960; at += 60) {
      const double to = std::lround((at - first) / 60) % 2 == 0 ? 980 : -980;
      path.push_back({-to, at, to, at});
      path.push_back({at, -to, at, to});
    }
    scan(localizer.outline(), path, seed, seen);
    LocalizeOptions options;
    options.range_mm = options.max_offset_mm = 50;
    options.range_rad = options.max_rotation_rad = rad(20);
    const double side = seed % 2 == 0 ? 1 : -1;
    options.planned = {side * (7 + 2.0 * static_cast<double>(seed)), 38 - 4.0 * static_cast<double>(seed),
                       rad(side * 0.9 * static_cast<double>(seed))};
    const Localization found = localizer.localize(seen.edges, seen.path, options);
    EXPECT_LT(found.pose.translation().norm(), 0.3) << "seed " << seed << ", " << found.reason;
  }
}

}  // namespace
}  // namespace weldcell::localize
