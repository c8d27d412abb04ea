#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <random>

#include "ladder.hpp"
#include "test_cell.hpp"
#include "weldcell/weld/rapid.hpp"

namespace weldcell::weld {
namespace {

using Eigen::Vector3d;
using test::ladder;
using test::test_cell;
using ::testing::HasSubstr;

CertifyOptions on_table(const cell::CellSetup& cell) {
  CertifyOptions o;
  o.table_z_mm = cell.table.z_mm;
  return o;
}

/// Every law that a planned path must keep, whatever the seam.
void expect_sound(const cell::CellSetup& cell, const workpiece::Weld& weld,
                  const WeldCertificate& certificate, const TorchPath& path) {
  ASSERT_EQ(path.first_seam, 2u);
  ASSERT_EQ(path.last_seam + 3, path.targets.size());
  ASSERT_EQ(path.last_seam - path.first_seam + 1, certificate.path.size());
  const int branch = path.targets[2].configuration.cfx;
  for (std::size_t k = 0; k < path.targets.size(); ++k) {
    const TorchTarget& t = path.targets[k];
    const auto reached = kinematics::forward(cell.arm, t.joints) * cell.torch.T_flange_torch;
    EXPECT_LT((reached.iso.matrix() - t.T_base_torch.iso.matrix()).norm(), 1e-6);
    EXPECT_NEAR(t.T_base_torch.rotation().determinant(), 1, 1e-9);
    EXPECT_EQ(t.configuration, kinematics::configuration(cell.arm, t.joints));
    EXPECT_EQ(t.configuration.cfx, branch) << weld.name << " target " << k;
    for (std::size_t j = 0; j < 6; ++j) {
      EXPECT_GE(t.joints[j], cell.arm.lower[j] + cell.limits.limit_margin_rad - 1e-12);
      EXPECT_LE(t.joints[j], cell.arm.upper[j] - cell.limits.limit_margin_rad + 1e-12);
    }
  }
  for (std::size_t k = path.first_seam; k <= path.last_seam; ++k) {
    const TorchTarget& t = path.targets[k];
    EXPECT_LT((t.T_base_torch.position_mm() - certificate.path[k - path.first_seam]).norm(), 1e-9);
    EXPECT_GE(std::abs(std::sin(t.joints[4])), cell.limits.min_sin_j5);
    if (k == path.first_seam) continue;
    for (std::size_t j = 0; j < 6; ++j) {
      EXPECT_LE(std::abs(t.joints[j] - path.targets[k - 1].joints[j]), rad(5) + 1e-12);
    }
  }
  const TorchTarget& approach = path.targets[1];
  const TorchTarget& start = path.targets[2];
  const Vector3d back = approach.T_base_torch.position_mm() - start.T_base_torch.position_mm();
  EXPECT_GE(back.norm(), 50 - 1e-6);
  EXPECT_NEAR(back.normalized().dot(start.T_base_torch.rotation().col(2)), -1, 1e-9);
}

TEST(TorchFrame, LeansLeftOfTravelAndPushes) {
  const Vector3d tip(10, 20, 30), travel = Vector3d::UnitX();
  const auto upright = torch_frame(tip, travel, 0, 0, 0);
  EXPECT_LT((upright.rotation().col(2) + Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_LT((upright.rotation().col(0) - Vector3d::UnitX()).norm(), 1e-12);
  EXPECT_LT((upright.position_mm() - tip).norm(), 1e-12);
  // The body of the torch lies along -Z: to the left of travel is +y.
  EXPECT_GT(-torch_frame(tip, travel, rad(45), 0, 0).rotation().col(2).y(), 0.7);
  // Pushing: the wire points ahead, the body trails.
  EXPECT_NEAR(torch_frame(tip, travel, 0, rad(10), 0).rotation().col(2).x(), std::sin(rad(10)), 1e-12);
  const auto both = torch_frame(tip, travel, rad(30), rad(10), rad(75));
  EXPECT_NEAR(both.rotation().determinant(), 1, 1e-12);
  EXPECT_LT((both.rotation().col(2) - torch_frame(tip, travel, rad(30), rad(10), 0).rotation().col(2)).norm(),
            1e-12);
}

TEST(PlanTorch, ReachesEveryTopSeamOfTheLadder) {
  const auto cell = test_cell();
  const auto part = ladder();
  const auto certificates = assume_exact(part, {900, 0, rad(8)}, on_table(cell));
  const auto began = std::chrono::steady_clock::now();
  const auto paths = plan_torch(cell, part, certificates, cell.home);
  std::printf("planned in %.1f ms\n",
              std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - began).count());
  ASSERT_TRUE(paths.ok()) << paths.error().text();
  ASSERT_EQ(paths->size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) expect_sound(cell, part.welds[i], certificates[i], (*paths)[i]);
}

TEST(PlanTorch, KeepsToolsAboveTheMembersOnAirMoves) {
  const auto cell = test_cell();
  const auto part = ladder();
  const auto paths = plan_torch(cell, part, assume_exact(part, {900, 0, 0}, on_table(cell)), cell.home);
  ASSERT_TRUE(paths.ok()) << paths.error().text();
  kinematics::Joints from = cell.home;
  for (std::size_t i = 0; i <= paths->size(); ++i) {
    const kinematics::Joints to = i < paths->size() ? (*paths)[i].targets.front().joints : cell.home;
    for (int s = 0; s <= 40; ++s) {
      kinematics::Joints q{};
      for (std::size_t j = 0; j < 6; ++j) q[j] = from[j] + (to[j] - from[j]) * s / 40.0;
      const auto torch = kinematics::forward(cell.arm, q) * cell.torch.T_flange_torch;
      EXPECT_GT(torch.position_mm().z(), cell.table.z_mm + part.height_mm + 10) << "before seam " << i;
    }
    if (i < paths->size()) from = (*paths)[i].targets.back().joints;
  }
}

TEST(PlanTorch, FilletsAtFortyFiveDegreesFromRandomHeadings) {
  constexpr std::uint64_t kSeed = 20272;
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> turn(-kPi, kPi), place(-80, 80), work(-45, 45);
  const auto cell = test_cell();
  int reached = 0;
  for (int trial = 0; trial < 40; ++trial) {
    auto part = ladder();
    const double heading = turn(random), work_deg = work(random);
    const Vector3d start(place(random), place(random), 40);
    part.welds = {test::straight("f", "rail_A", "rung_1", start,
                                 start + 60 * Vector3d(std::cos(heading), std::sin(heading), 0))};
    part.welds[0].work_angle_rad = rad(work_deg);
    const auto certificates = assume_exact(part, {880, 0, 0}, on_table(cell));
    const auto paths = plan_torch(cell, part, certificates, cell.home);
    SCOPED_TRACE(::testing::Message()
                 << "heading " << deg(heading) << " work " << work_deg << " start " << start.transpose());
    if (!paths.ok()) {
      std::printf("%s\n", paths.error().text().c_str());
      continue;
    }
    ++reached;
    expect_sound(cell, part.welds[0], certificates[0], (*paths)[0]);
  }
  EXPECT_GE(reached, 38);
}

TEST(PlanTorch, TurnsTheTorchAlongAnArc) {
  const auto cell = test_cell();
  auto part = ladder();
  workpiece::Weld arc = part.welds[0];
  arc.start = {60, 0, 40};
  arc.pieces = {{true, {0, 60, 40}, {-60, 0, 40}}};
  part.welds = {arc};
  const auto certificates = assume_exact(part, {900, 0, 0}, on_table(cell));
  const auto paths = plan_torch(cell, part, certificates, cell.home);
  ASSERT_TRUE(paths.ok()) << paths.error().text();
  expect_sound(cell, part.welds[0], certificates[0], (*paths)[0]);
}

TEST(PlanTorch, NamesTheWeldAndThePointOutOfReach) {
  const auto cell = test_cell();
  const auto part = ladder();
  const auto far = plan_torch(cell, part, assume_exact(part, {2400, 0, 0}, on_table(cell)), cell.home);
  ASSERT_FALSE(far.ok());
  EXPECT_EQ(far.error().code, "weld.unreachable");
  EXPECT_THAT(far.error().text(), HasSubstr("weld a1"));
  EXPECT_THAT(far.error().text(), HasSubstr("x 2100.0 y -110.0 z 540.0"));
}

TEST(PlanTorch, RefusesWhatIsNotCertified) {
  const auto cell = test_cell();
  auto part = ladder();
  auto certificates = assume_exact(part, {900, 0, 0}, on_table(cell));
  certificates[3].verdict = localize::Verdict::Rescan;
  const auto refused = plan_torch(cell, part, certificates, cell.home);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, "weld.not_certified");
  EXPECT_THAT(refused.error().text(), HasSubstr("weld b2"));
  part.welds.pop_back();
  EXPECT_FALSE(plan_torch(cell, part, certificates, cell.home).ok());
  part.welds = {test::straight("v", "rail_A", "rung_1", {-260, -110, 0}, {-260, -110, 40})};
  const auto vertical = plan_torch(cell, part, assume_exact(part, {900, 0, 0}, on_table(cell)), cell.home);
  ASSERT_FALSE(vertical.ok());
  EXPECT_EQ(vertical.error().code, "weld.vertical");
}

}  // namespace
}  // namespace weldcell::weld
