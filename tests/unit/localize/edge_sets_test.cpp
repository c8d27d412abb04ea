#include <gtest/gtest.h>

#include "edge_sets.hpp"
#include "weldcell/localize/localizer.hpp"

namespace weldcell::localize {
namespace {

const std::string kFolder = WELDCELL_TEST_DATA "/edges";

/// Lines 40 mm apart may pass a joint of a member as wide by; of these sets one does.
bool passes_a_joint_by(const std::string& name, const std::string& kind, int i) {
  return name == "nearsym" && kind == "lat8spi" && i == 1;
}

class EdgeSets : public ::testing::TestWithParam<std::tuple<const char*, const char*>> {};

TEST_P(EdgeSets, PoseIsFoundWithinAMillimetreAndAFifthOfADegree) {
  const auto [name, kind] = GetParam();
  const auto outline = workpiece::build_template(testing::read_workpiece(kFolder, name));
  ASSERT_TRUE(outline.ok());
  const Localizer localizer(*outline);
  for (int i = 0; i < 2; ++i) {
    const auto set = testing::read_set(kFolder, name, kind, i);
    LocalizeOptions options;
    if (std::string(kind) == "extreme") {
      options.range_mm = 100;
      options.range_rad = kPi;
      options.max_offset_mm = 100;
      options.max_rotation_rad = kPi;
    }
    const Localization found = localizer.localize(set.edges, set.path, options);
    double best = 1e9;
    std::vector<Pose2> images{found.pose};
    for (const auto& s : outline->symmetries) {
      if (s.gap_mm == 0) images.push_back(found.pose * s.map);
    }
    for (const Pose2& image : images) {
      const Offset off = offset_from_planned(*outline, set.truth, image);
      best = std::min(best, std::max(std::hypot(off.dx_mm, off.dy_mm), 5 * std::abs(deg(off.dtheta_rad))));
    }
    EXPECT_LT(best, 1.0) << name << "/" << kind << "/" << i << ": " << found.cause << ": " << found.reason;
    if (std::string(kind) == "hard") continue;
    if (std::string(kind) == "missing") {
      EXPECT_NE(found.verdict, Verdict::Weld) << name << "/" << kind << "/" << i;
      EXPECT_EQ(found.cause, "member_missing") << name << "/" << kind << "/" << i << found.reason;
    } else if (passes_a_joint_by(name, kind, i)) {
      EXPECT_EQ(found.verdict, Verdict::Rescan) << name << "/" << kind << "/" << i;
      EXPECT_EQ(found.cause, "not_looked_at") << name << "/" << kind << "/" << i << found.reason;
      EXPECT_FALSE(found.rescan.empty());
    } else {
      EXPECT_EQ(found.verdict, Verdict::Weld)
          << name << "/" << kind << "/" << i << ": " << found.cause << ": " << found.reason;
    }
    if (std::string(kind) == "lat8zig") {
      ASSERT_TRUE(found.latency_s.has_value());
      EXPECT_NEAR(*found.latency_s, 0.008, 0.0004);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, EdgeSets,
                         ::testing::Combine(::testing::Values("ladder", "nearsym", "rect"),
                                            ::testing::Values("base", "extreme", "hard", "lat8spi", "lat8zig",
                                                              "missing", "out10", "out30", "var1", "wide")),
                         [](const auto& set) {
                           return std::string(std::get<0>(set.param)) + "_" + std::get<1>(set.param);
                         });

}  // namespace
}  // namespace weldcell::localize
