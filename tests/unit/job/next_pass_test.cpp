// The pass after the first: the lines asked for where nothing else is open, else a zigzag over the whole.
#include <gtest/gtest.h>

#include "unit/plan/demo_cell.hpp"
#include "weldcell/job/work.hpp"

namespace weldcell::job {
namespace {

struct Scene {
  cell::CellSetup cell = weldcell::testing::demo_cell();
  JobInput job;
  Prepared prepared;
  Solution before;

  Scene() {
    job.workpiece = weldcell::testing::ladder();
    plan::MotionPlan scan;
    scan.id = 1;
    scan.samples.resize(1);
    scan.samples.front().q = cell.home;
    prepared.scan = std::make_shared<const plan::MotionPlan>(scan);
    before.found.verdict = localize::Verdict::Rescan;
    before.found.cause = "not_looked_at";
    before.found.pose = {1250, -600, rad(91)};
    before.found.rescan = {{"rung_2", {400, 100}, {400, 10}}, {"rung_3", {780, 590}, {780, 500}}};
    weld::WeldCertificate seam;
    seam.tolerance_mm = 0.6;
    seam.bound_mm = 0.3;
    before.certificates = {seam};
  }
  std::vector<plan::BeamPath> paths(int pass) const {
    auto next = plan_next_pass(cell, job, prepared, before, pass);
    EXPECT_TRUE(next.ok());
    return next.ok() ? next->paths : std::vector<plan::BeamPath>{};
  }
};

TEST(NextPass, DrivesExactlyTheLinesAskedForAtTheFoundPose) {
  Scene s;
  const auto paths = s.paths(2);
  ASSERT_EQ(paths.size(), s.before.found.rescan.size());
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const localize::ScanLine& line = s.before.found.rescan[i];
    ASSERT_EQ(paths[i].points.size(), 2u);
    const Vec2 a = s.before.found.pose * line.from, b = s.before.found.pose * line.to;
    const bool there = (paths[i].points[0] - a).norm() < 1e-9 && (paths[i].points[1] - b).norm() < 1e-9;
    const bool back = (paths[i].points[0] - b).norm() < 1e-9 && (paths[i].points[1] - a).norm() < 1e-9;
    EXPECT_TRUE(there || back) << paths[i].name;
    const Vec2 receiver(std::cos(paths[i].receiver_angle_rad), std::sin(paths[i].receiver_angle_rad));
    EXPECT_NEAR(receiver.dot(b - a), 0, 1e-6) << "the triangulation plane lies along the edge";
  }
}

TEST(NextPass, IsAZigzagWhereASeamIsNotKnownWellEnough) {
  Scene s;
  s.before.certificates.front().bound_mm = 0.9;
  EXPECT_GT(s.paths(2).size(), 20u);
}

TEST(NextPass, OfAnAdaptiveInspectionIsFirstAZigzagAndThenTheLines) {
  Scene s;
  s.job.order.inspection.pattern = plan::Pattern::Adaptive;
  EXPECT_GT(s.paths(2).size(), 20u);
  EXPECT_EQ(s.paths(3).size(), 2u);
}

TEST(NextPass, IsAZigzagWhereNoLineIsAskedFor) {
  Scene s;
  s.before.found.rescan.clear();
  s.before.found.cause = "ambiguous";
  EXPECT_GT(s.paths(2).size(), 20u);
}

}  // namespace
}  // namespace weldcell::job
