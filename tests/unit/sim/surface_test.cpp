// Where a beam meets a bar with round edges, against the solid's own faces: planes and cylinders met one by
// one.
#include "sim/surface.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "fixture.hpp"

namespace weldcell::sim {
namespace {

constexpr double kTable_mm = 500, kHeight_mm = 40, kLength_mm = 400;

/// One bar along x from (0, 0), its two long edges round.
Scene bar(double width_mm, double radius_mm) {
  Scene scene = test_scene();
  scene.planned = scene.truth = {0, 0, 0};
  workpiece::Member& member = scene.workpiece.members.front();
  member.outline = {{0, 0}, {kLength_mm, 0}, {kLength_mm, width_mm}, {0, width_mm}};
  member.edge_radius_mm = radius_mm;
  return scene;
}

/// Distance to the first face of the bar or the table that the ray meets; infinite where it meets none.
double first_face(const Eigen::Vector3d& from, const Eigen::Vector3d& d, double width_mm, double radius_mm) {
  constexpr double kSlack = 1e-9;
  double nearest = (kTable_mm - from.z()) / d.z();
  const auto meet = [&](double t, auto&& on_face) {
    const Eigen::Vector3d p = from + t * d;
    if (t >= 0 && t < nearest && on_face(p)) nearest = t;
  };
  const double top = kTable_mm + kHeight_mm, wall = top - radius_mm;
  const auto along = [](const Eigen::Vector3d& p) {
    return p.x() >= -kSlack && p.x() <= kLength_mm + kSlack;
  };
  meet((top - from.z()) / d.z(), [&](const Eigen::Vector3d& p) {
    return along(p) && p.y() >= radius_mm - kSlack && p.y() <= width_mm - radius_mm + kSlack;
  });
  for (const double y : {0.0, width_mm}) {
    if (d.y() == 0) break;
    meet((y - from.y()) / d.y(),
         [&](const Eigen::Vector3d& p) { return along(p) && p.z() <= wall && p.z() >= kTable_mm; });
  }
  // A long edge: the quarter of a cylinder about a line at (y, wall), outwards and upwards of it.
  for (const auto& [y, outwards] : {std::pair{radius_mm, -1.0}, {width_mm - radius_mm, 1.0}}) {
    const double a = d.y() * d.y() + d.z() * d.z(), py = from.y() - y, pz = from.z() - wall;
    const double half_b = py * d.y() + pz * d.z(), c = py * py + pz * pz - radius_mm * radius_mm;
    const double root = half_b * half_b - a * c;
    if (root < 0) continue;
    for (const double sign : {-1.0, 1.0}) {
      meet((-half_b + sign * std::sqrt(root)) / a, [&](const Eigen::Vector3d& p) {
        return along(p) && p.z() >= wall && outwards * (p.y() - y) >= 0;
      });
    }
  }
  for (const double x : {0.0, kLength_mm}) {
    if (d.x() == 0) break;
    meet((x - from.x()) / d.x(), [&](const Eigen::Vector3d& p) {
      if (p.y() < 0 || p.y() > width_mm) return false;
      const double in = std::min({radius_mm, p.y(), width_mm - p.y()}), missing = radius_mm - in;
      return p.z() >= kTable_mm && p.z() <= wall + std::sqrt(radius_mm * radius_mm - missing * missing);
    });
  }
  return nearest;
}

struct Bar {
  const char* name;
  double width_mm, radius_mm, tilt_deg;
};

class SurfaceOfABar : public testing::TestWithParam<Bar> {};

TEST_P(SurfaceOfABar, ABeamEndsAtTheFirstFaceThatItMeets) {
  const Bar& b = GetParam();
  const Surface surface(bar(b.width_mm, b.radius_mm), 1);
  std::mt19937_64 random(20261127);
  std::uniform_real_distribution<double> at_x(-10, kLength_mm + 10), at_y(-10, b.width_mm + 10),
      turn(-kPi, kPi), lean(0, rad(b.tilt_deg));
  int on_edges = 0, on_walls = 0;
  for (int i = 0; i < 20'000; ++i) {
    const double tilt = lean(random), around = turn(random);
    const Eigen::Vector3d d(std::sin(tilt) * std::cos(around), std::sin(tilt) * std::sin(around),
                            -std::cos(tilt));
    const double z = kTable_mm + kHeight_mm * (i % 2 == 0 ? 1.0 : 0.5);
    const Eigen::Vector3d aim(at_x(random), at_y(random), z), from = aim - 230 * d;
    const double expected = first_face(from, d, b.width_mm, b.radius_mm);
    ASSERT_NEAR(surface.cast(from, d), expected, 1e-4)
        << "trial " << i << " aimed at " << aim.transpose() << " along " << d.transpose();
    const double met = from.z() + expected * d.z() - kTable_mm;
    on_edges += met > kHeight_mm - b.radius_mm + 1e-6 && met < kHeight_mm - 1e-6;
    on_walls += met > 1e-6 && met < kHeight_mm - b.radius_mm - 1e-6;
  }
  EXPECT_GT(on_walls, b.tilt_deg > 0 ? 200 : -1);
  EXPECT_GT(on_edges, b.radius_mm > 0 ? 200 : -1);
}

INSTANTIATE_TEST_SUITE_P(, SurfaceOfABar,
                         testing::Values(Bar{"upright", 40, 5, 0}, Bar{"leaning", 40, 5, 20},
                                         Bar{"sharp", 40, 0, 20}, Bar{"plate", 6, 1, 20},
                                         Bar{"rod", 10, 5, 30}),
                         [](const auto& p) { return std::string(p.param.name); });

TEST(Surface, AnAngledMemberStopsABeamLikeTheTwoBarsItIsMadeOf) {
  Scene one = bar(40, 0), two = one;
  one.workpiece.members[0].outline = {{0, 0}, {300, 0}, {300, 40}, {40, 40}, {40, 200}, {0, 200}};
  two.workpiece.members[0].outline = {{0, 0}, {300, 0}, {300, 40}, {0, 40}};
  two.workpiece.members.push_back(two.workpiece.members[0]);
  two.workpiece.members[1].outline = {{0, 40}, {40, 40}, {40, 200}, {0, 200}};
  two.members.resize(2);
  const Surface angled(one, 1), bars(two, 1);
  std::mt19937_64 random(20261127);
  std::uniform_real_distribution<double> at(-10, 210), turn(-kPi, kPi), lean(0, rad(20));
  int differ = 0;
  constexpr int kTrials = 20'000;
  for (int i = 0; i < kTrials; ++i) {
    const double tilt = lean(random), around = turn(random);
    const Eigen::Vector3d d(std::sin(tilt) * std::cos(around), std::sin(tilt) * std::sin(around),
                            -std::cos(tilt));
    const Eigen::Vector3d from = Eigen::Vector3d(at(random), at(random), kTable_mm + 20) - 230 * d;
    differ += std::abs(angled.cast(from, d) - bars.cast(from, d)) > 1e-4;
  }
  // The angled one is looked for in steps of 0.1 mm: a beam that cuts a corner by less may pass.
  EXPECT_LT(differ, kTrials / 1000);
}

TEST(Surface, SeesWhatNothingStandsInFrontOf) {
  Scene scene = bar(10, 3);
  scene.workpiece.members.push_back(scene.workpiece.members[0]);
  for (Vec2& p : scene.workpiece.members[1].outline) p.y() += 25;
  scene.members.resize(2);
  const Surface surface(scene, 1);
  std::mt19937_64 random(20261127);
  std::uniform_real_distribution<double> at_x(5, kLength_mm - 5), at_y(-30, 65), lean(rad(-40), rad(40));
  int hidden = 0;
  for (int i = 0; i < 5'000; ++i) {
    const double y = at_y(random), tilt = lean(random);
    const Eigen::Vector3d point(at_x(random), y, kTable_mm + surface.height(50, y));
    const Eigen::Vector3d way(0, std::sin(tilt), std::cos(tilt));
    double least = 1e9;  // height over what stands on the way, from close to the point to beyond the tops
    for (double t = 0.05; t < 60; t += 0.02) {
      const Eigen::Vector3d p = point + t * way;
      least = std::min(least, p.z() - kTable_mm - surface.height(p.x(), p.y()));
    }
    if (std::abs(least) < 1e-3) continue;  // grazes
    ASSERT_EQ(surface.sees(point, point + 230 * way), least > 0)
        << "trial " << i << ", y " << y << ", tilt " << tilt;
    hidden += least < 0;
  }
  EXPECT_GT(hidden, 500);
}

}  // namespace
}  // namespace weldcell::sim
