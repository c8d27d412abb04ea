#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "unit/plan/demo_cell.hpp"
#include "weldcell/plan/scan_plan.hpp"

namespace weldcell::plan {
namespace {

constexpr std::uint64_t kSeed = 1618;
constexpr double kTop_mm = 540;

struct Foot {
  Vec2 at;
  double height_mm;  ///< of the foot at stand-off
  double receiver_rad;
  double upright;  ///< -1 when the beam points straight down
};

Foot foot_of(const cell::CellSetup& cell, const kinematics::Joints& q) {
  const Transform<Base, Laser> beam = kinematics::forward(cell.arm, q) * cell.laser.T_flange_laser;
  const Point<Base> foot = beam * Point<Laser>{{0, 0, cell.laser.standoff_mm}};
  const Eigen::Vector3d x = beam.rotation().col(0);
  return {foot.mm.head<2>(), foot.mm.z(), std::atan2(x.y(), x.x()), beam.rotation()(2, 2)};
}

double distance_to(const BeamPath& path, const Vec2& p) {
  double best = 1e300;
  for (std::size_t i = 0; i + 1 < path.points.size(); ++i) {
    best = std::min(best, distance(p, Segment{path.points[i], path.points[i + 1]}));
  }
  return best;
}

/// The passes lie on their paths, at one speed, with the beam straight down and the receiver held.
void expect_follows(const cell::CellSetup& cell, const std::vector<BeamPath>& paths, const MotionPlan& plan,
                    double speed_mm_s) {
  ASSERT_EQ(plan.passes.size(), paths.size());
  double before_s = 0;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const ScanPass& pass = plan.passes[i];
    SCOPED_TRACE(pass.name);
    EXPECT_EQ(pass.name, paths[i].name);
    EXPECT_GT(pass.from_s, before_s) << "no room to reach the speed";
    EXPECT_LT((foot_of(cell, sample_at(plan, pass.from_s).q).at - paths[i].points.front()).norm(), 0.05);
    EXPECT_LT((foot_of(cell, sample_at(plan, pass.to_s).q).at - paths[i].points.back()).norm(), 0.05);
    const double step_s = std::max(0.02, (pass.to_s - pass.from_s) / 200);
    for (double t = pass.from_s; t <= pass.to_s; t += step_s) {
      const Foot foot = foot_of(cell, sample_at(plan, t).q);
      // The curve is smooth where the path has chords.
      EXPECT_LT(distance_to(paths[i], foot.at), 0.2);
      EXPECT_NEAR(foot.height_mm, kTop_mm, 0.01);
      EXPECT_NEAR(foot.upright, -1, 1e-8);
      EXPECT_NEAR(std::remainder(foot.receiver_rad - paths[i].receiver_angle_rad, kPi), 0, 1e-4);
      if (t + 0.002 > pass.to_s) continue;
      const double v = (foot_of(cell, sample_at(plan, t + 0.002).q).at - foot.at).norm() / 0.002;
      EXPECT_LT(v, speed_mm_s * 1.01);
    }
    before_s = pass.to_s;
  }
  EXPECT_LT(before_s, plan.duration_s());
}

TEST(PlanScan, SparseSpiralOfTheLadderTakesLessThan45Seconds) {
  const cell::CellSetup cell = testing::demo_cell();
  Inspection inspection;
  inspection.pitch_mm = 120, inspection.speed_mm_s = 250;
  const auto paths = beam_paths(testing::ladder(), testing::kLadderPose, inspection, Pattern::Spiral);
  const Result<MotionPlan> plan = plan_scan(cell, paths, kTop_mm, inspection.speed_mm_s, cell.home);
  ASSERT_TRUE(plan.ok()) << plan.error().text();
  std::printf("spiral of the ladder: %.1f s\n", plan->duration_s());
  EXPECT_LT(plan->duration_s(), 45);
  EXPECT_TRUE(preflight(cell, *plan).ok());
  expect_follows(cell, paths, *plan, inspection.speed_mm_s);
}

TEST(PlanScan, ZigzagOfTheLadderTakesLessThan35Seconds) {
  const cell::CellSetup cell = testing::demo_cell();
  Inspection inspection;
  inspection.passes_per_member = 2;
  const auto paths = beam_paths(testing::ladder(), testing::kLadderPose, inspection, Pattern::Zigzag);
  const Result<MotionPlan> plan = plan_scan(cell, paths, kTop_mm, inspection.speed_mm_s, cell.home);
  ASSERT_TRUE(plan.ok()) << plan.error().text();
  std::printf("zigzag of the ladder: %.1f s\n", plan->duration_s());
  EXPECT_LT(plan->duration_s(), 35);
  EXPECT_TRUE(preflight(cell, *plan).ok());
  expect_follows(cell, paths, *plan, inspection.speed_mm_s);
  // A line is measured at one speed from end to end.
  ASSERT_EQ(plan->passes.size(), paths.size());
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const ScanPass& pass = plan->passes[i];
    const double length = (paths[i].points[1] - paths[i].points[0]).norm();
    EXPECT_NEAR((pass.to_s - pass.from_s) * inspection.speed_mm_s, length, 0.03 * length) << pass.name;
  }
}

TEST(PlanScan, RandomPlacementsObeyEveryLimit) {
  const cell::CellSetup cell = testing::demo_cell();
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> shift(-15, 15), turn(-rad(20), rad(20)), speed(60, 400),
      pitch(60, 200);
  int planned = 0;
  for (int n = 0; n < 24; ++n) {
    const bool frame = n % 2 == 1;
    const workpiece::Workpiece part = frame ? testing::mitre() : testing::ladder();
    const Vec2 middle = frame ? Vec2(400, 250) : Vec2(600, 300);
    const Pose2 about{middle.x(), middle.y(), 0};
    const Pose2 pose = (frame ? testing::kMitrePose : testing::kLadderPose) * about *
                       Pose2{shift(random), shift(random), turn(random)} * about.inverse();
    Inspection inspection;
    inspection.pitch_mm = pitch(random), inspection.speed_mm_s = speed(random);
    inspection.margin_rad = 0.05;
    const Pattern pattern = n % 4 < 2 ? Pattern::Spiral : Pattern::Zigzag;
    SCOPED_TRACE(::testing::Message()
                 << n << ": " << part.name << " at " << pose.x_mm << " " << pose.y_mm << " " << pose.theta_rad
                 << " pitch " << inspection.pitch_mm << " speed " << inspection.speed_mm_s);
    const auto paths = beam_paths(part, pose, inspection, pattern);
    const Result<MotionPlan> plan = plan_scan(cell, paths, kTop_mm, inspection.speed_mm_s, cell.home);
    ASSERT_TRUE(plan.ok()) << plan.error().text();
    EXPECT_TRUE(preflight(cell, *plan).ok());
    expect_follows(cell, paths, *plan, inspection.speed_mm_s);
    ++planned;
  }
  EXPECT_EQ(planned, 24);
}

TEST(PlanScan, SlowsWhereTheArmCannotFollow) {
  cell::CellSetup cell = testing::demo_cell();
  cell.arm.max_speed.fill(rad(20));
  Inspection inspection;
  inspection.pitch_mm = 120, inspection.speed_mm_s = 400;
  const auto paths = beam_paths(testing::mitre(), testing::kMitrePose, inspection, Pattern::Spiral);
  const Result<MotionPlan> plan = plan_scan(cell, paths, kTop_mm, inspection.speed_mm_s, cell.home);
  ASSERT_TRUE(plan.ok()) << plan.error().text();
  EXPECT_TRUE(preflight(cell, *plan).ok());
  double fastest = 0;
  for (const MotionSample& s : plan->samples) {
    for (const double v : s.qd) fastest = std::max(fastest, std::abs(v));
  }
  EXPECT_GT(fastest, rad(8)) << "the limit of 10 deg/s was not used";
}

TEST(PlanScan, TurnsTheReceiverByHalfATurnRatherThanRunOutOfWrist) {
  cell::CellSetup cell = testing::demo_cell();
  cell.arm.lower[5] = rad(-110), cell.arm.upper[5] = rad(110);
  Inspection inspection;
  inspection.passes_per_member = 2;
  for (const double theta : {0.0, 90.0, 180.0, -90.0}) {
    const Vec2 corner = Vec2(950, 0) - Pose2{0, 0, rad(theta)} * Vec2(400, 250);
    const Pose2 pose{corner.x(), corner.y(), rad(theta)};
    const auto paths = beam_paths(testing::mitre(), pose, inspection, Pattern::Zigzag);
    const Result<MotionPlan> plan = plan_scan(cell, paths, kTop_mm, 200, cell.home);
    ASSERT_TRUE(plan.ok()) << theta << ": " << plan.error().text();
    expect_follows(cell, paths, *plan, 200);
  }
}

TEST(PlanScan, NamesWhatItCannotReach) {
  const cell::CellSetup cell = testing::demo_cell();
  std::vector<BeamPath> paths{{"near line", {{900, 0}, {980, 0}}, 0},
                              {"far line", {{1900, 0}, {1980, 0}}, 0}};
  const Result<MotionPlan> plan = plan_scan(cell, paths, kTop_mm, 200, cell.home);
  ASSERT_FALSE(plan.ok());
  EXPECT_EQ(plan.error().code, "plan.unreachable");
  EXPECT_NE(plan.error().text().find("far line"), std::string::npos) << plan.error().text();
  EXPECT_NE(plan.error().text().find("1900"), std::string::npos) << plan.error().text();
  EXPECT_EQ(plan_scan(cell, {}, kTop_mm, 200, cell.home).error().code, "plan.empty");
  EXPECT_EQ(plan_scan(cell, {{"one point", {{900, 0}}, 0}}, kTop_mm, 200, cell.home).error().code,
            "plan.empty");
  EXPECT_EQ(plan_scan(cell, {paths[0]}, kTop_mm, 0, cell.home).error().code, "plan.speed");
  EXPECT_EQ(plan_scan(cell, {paths[0]}, kTop_mm, 0.05, cell.home).error().code, "plan.too_long");
  EXPECT_EQ(
      plan_scan(cell, {{"lost", {{900, std::nan("")}, {980, 0}}, 0}}, kTop_mm, 200, cell.home).error().code,
      "plan.too_long");
}

TEST(PlanScan, IsTheSameEveryTime) {
  const cell::CellSetup cell = testing::demo_cell();
  Inspection inspection;
  inspection.passes_per_member = 2;
  const auto paths = beam_paths(testing::mitre(), testing::kMitrePose, inspection, Pattern::Zigzag);
  const Result<MotionPlan> a = plan_scan(cell, paths, kTop_mm, 200, cell.home);
  const Result<MotionPlan> b = plan_scan(cell, paths, kTop_mm, 200, cell.home);
  ASSERT_TRUE(a.ok() && b.ok());
  ASSERT_EQ(a->samples.size(), b->samples.size());
  for (std::size_t k = 0; k < a->samples.size(); ++k) ASSERT_EQ(a->samples[k].q, b->samples[k].q);
}

}  // namespace
}  // namespace weldcell::plan
