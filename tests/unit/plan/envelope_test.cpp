#include <gtest/gtest.h>

#include <cmath>

#include "unit/plan/demo_cell.hpp"
#include "weldcell/plan/scan_plan.hpp"

namespace weldcell::plan {
namespace {

TEST(CentreInEnvelope, GivesAPoseThatCanBeScanned) {
  const cell::CellSetup cell = testing::demo_cell();
  for (const workpiece::Workpiece& part : {testing::ladder(), testing::mitre()}) {
    SCOPED_TRACE(part.name);
    const Result<Pose2> pose = centre_in_envelope(cell, part);
    ASSERT_TRUE(pose.ok()) << pose.error().text();
    for (const workpiece::Member& m : part.members) {
      for (const Vec2& corner : m.outline) {
        const Vec2 p = *pose * corner;
        EXPECT_TRUE(p.x() >= cell.table.area.min.x() && p.x() <= cell.table.area.max.x());
        EXPECT_TRUE(p.y() >= cell.table.area.min.y() && p.y() <= cell.table.area.max.y());
      }
    }
    Inspection inspection;
    inspection.pitch_mm = 120;
    for (const Pattern pattern : {Pattern::Spiral, Pattern::Zigzag}) {
      const Result<MotionPlan> plan =
          plan_scan(cell, beam_paths(part, *pose, inspection, pattern), 540, 250, cell.home);
      EXPECT_TRUE(plan.ok()) << plan.error().text();
    }
  }
}

TEST(CentreInEnvelope, RefusesWhatTheArmIsTooSmallFor) {
  cell::CellSetup cell = testing::demo_cell();
  cell.arm = testing::arm_from(testing::kReferenceArms[2]);  // 0.58 m reach
  const Result<Pose2> pose = centre_in_envelope(cell, testing::ladder());
  ASSERT_FALSE(pose.ok());
  EXPECT_EQ(pose.error().code, "plan.unreachable");
}

TEST(GuidePose, LooksDownOnThePoint) {
  const cell::CellSetup cell = testing::demo_cell();
  for (double x = 500; x <= 1400; x += 150) {
    for (double y = -600; y <= 600; y += 300) {
      SCOPED_TRACE(::testing::Message() << x << " " << y);
      const Result<GuidePose> guide = guide_pose(cell, {x, y}, rad(90), cell.home);
      ASSERT_TRUE(guide.ok()) << guide.error().text();
      const Eigen::Vector3d eye = guide->T_base_projector.position_mm();
      const Eigen::Vector3d axis = guide->T_base_projector.rotation().col(2);
      const double way = (cell.table.z_mm - eye.z()) / axis.z();
      EXPECT_LT((eye + way * axis - Eigen::Vector3d(x, y, cell.table.z_mm)).norm(), 1e-6);
      EXPECT_GE(way, 450 - 1e-6);
      EXPECT_LE(way, cell.projector.distance_mm + 1e-6);
      EXPECT_GE(-axis.z(), std::cos(rad(15)) - 1e-9);
      const Transform<Base, Projector> held =
          kinematics::forward(cell.arm, guide->joints) * cell.projector.T_flange_projector;
      EXPECT_LT((held.iso.matrix() - guide->T_base_projector.iso.matrix()).norm(), 1e-6);
      EXPECT_TRUE(kinematics::within_limits(cell.arm, guide->joints, cell.limits.limit_margin_rad));
    }
  }
}

TEST(GuidePose, KeepsTheHeadingWhereItCan) {
  const cell::CellSetup cell = testing::demo_cell();
  const Result<GuidePose> guide = guide_pose(cell, {950, 0}, rad(30), cell.home);
  ASSERT_TRUE(guide.ok());
  const Eigen::Vector3d right = guide->T_base_projector.rotation().col(0);
  EXPECT_NEAR(std::atan2(right.y(), right.x()), rad(30), 1e-9);
  EXPECT_NEAR(guide->T_base_projector.position_mm().z() - cell.table.z_mm, cell.projector.distance_mm, 1e-6);
}

TEST(GuidePose, ComesNearerAndTiltsAtTheRimAndRefusesBeyond) {
  const cell::CellSetup cell = testing::demo_cell();
  bool nearer = false, tilted = false, refused = false;
  for (double x = 1300; x <= 2400; x += 10) {
    const Result<GuidePose> guide = guide_pose(cell, {x, 0}, 0, cell.home);
    if (!guide) {
      refused = true;
      EXPECT_EQ(guide.error().code, "plan.unreachable");
      continue;
    }
    const Eigen::Vector3d away =
        guide->T_base_projector.position_mm() - Eigen::Vector3d(x, 0, cell.table.z_mm);
    nearer = nearer || away.norm() < cell.projector.distance_mm - 1;
    tilted = tilted || away.z() < away.norm() * std::cos(rad(4));
  }
  EXPECT_TRUE(nearer);
  EXPECT_TRUE(tilted);
  EXPECT_TRUE(refused);
}

TEST(DemoCell, TorchReachesEverySeamWhereverThePartMayLie) {
  const cell::CellSetup cell = testing::demo_cell();
  double worst = 1;
  for (const double turn : {-20.0, 0.0, 20.0}) {
    for (const double shift : {-15.0, 15.0}) {
      const Pose2 about{600, 300, 0};
      const Pose2 pose = testing::kLadderPose * about * Pose2{shift, shift, rad(turn)} * about.inverse();
      for (const workpiece::Weld& weld : testing::ladder().welds) {
        for (const Eigen::Vector3d& p : workpiece::sample_path(weld, 10)) {
          const Eigen::Vector3d at = part_on_table(pose, cell.table.z_mm).iso * p;
          double best = -1;
          for (int roll = 0; roll < 24; ++roll) {
            Transform<Base, Torch> torch;
            const double c = std::cos(roll * kPi / 12), s = std::sin(roll * kPi / 12);
            torch.iso.linear() << c, s, 0, s, -c, 0, 0, 0, -1;
            torch.iso.translation() = at;
            for (const kinematics::Joints& q :
                 kinematics::inverse(cell.arm, torch * cell.torch.T_flange_torch.inverse(), cell.home,
                                     cell.limits.limit_margin_rad)) {
              if (kinematics::configuration(cell.arm, q).cfx == 0)
                best = std::max(best, kinematics::dexterity(cell.arm, q));
            }
          }
          worst = std::min(worst, best);
        }
      }
    }
  }
  std::printf("worst dexterity of the torch over all seams: %.3f\n", worst);
  EXPECT_GT(worst, 0.2);
}

}  // namespace
}  // namespace weldcell::plan
