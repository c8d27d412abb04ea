#include "weldcell/weld/certificate.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cstdio>
#include <random>

#include "ladder.hpp"

namespace weldcell::weld {
namespace {

using localize::Verdict;
using test::found_ladder;
using test::ladder;
using ::testing::HasSubstr;

Eigen::Vector3d draw(const Eigen::Matrix3d& covariance, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const Eigen::Vector3d unit(normal(random), normal(random), normal(random));
  return covariance.llt().matrixL() * unit;
}

/// Moves p by a small motion stated about c, with a true rotation: nothing here is linearized.
Vec2 moved(const Vec2& p, const Vec2& c, const Eigen::Vector3d& motion) {
  const Vec2 r = p - c;
  const double k = std::cos(motion.z()), s = std::sin(motion.z());
  return c + Vec2(k * r.x() - s * r.y(), s * r.x() + k * r.y()) + motion.head<2>();
}

TEST(Certificate, BoundCoversNinetyFivePercentOfSimulatedErrors) {
  constexpr std::uint64_t kSeed = 20271;
  constexpr int kTrials = 4000;
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  std::mt19937_64 random(kSeed);
  std::normal_distribution<double> normal;
  const auto part = ladder();
  const auto found = found_ladder(part, {900, 30, rad(12)});
  const CertifyOptions options;
  const auto certificates = certify(part, found, options);
  ASSERT_EQ(certificates.size(), 6u);
  for (std::size_t w = 0; w < certificates.size(); ++w) {
    const WeldCertificate& c = certificates[w];
    const Vec2 t = (c.path.back() - c.path.front()).head<2>().normalized(), n(-t.y(), t.x());
    int covered = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      const Eigen::Vector3d part_error = draw(found.covariance, random);
      Vec2 mean = Vec2::Zero();
      for (const std::string& name : part.welds[w].joins) {
        for (std::size_t m = 0; m < part.members.size(); ++m) {
          if (part.members[m].name != name) continue;
          const Vec2 centre = found.pose * centroid(part.members[m].outline);
          mean += moved(c.worst.head<2>(), centre, draw(found.members[m].covariance, random)) / 2;
        }
      }
      const Vec2 truth = moved(mean, found.centroid_base, part_error);
      const double error = n.dot(truth - c.worst.head<2>()) + options.robot_sigma_mm * normal(random);
      covered += std::abs(error) <= c.bound_mm;
    }
    const double share = static_cast<double>(covered) / kTrials;
    EXPECT_GT(share, 0.93) << c.name << " bound " << c.bound_mm;
    EXPECT_LT(share, 0.97) << c.name << " bound " << c.bound_mm;
  }
}

TEST(Certificate, PathFollowsThePartTheTableAndTheMeanOfTheJoinedMembers) {
  const auto part = ladder();
  auto found = found_ladder(part, {900, 30, rad(12)});
  found.members[0].dx_mm = 0.4;  // rail_A
  found.members[2].dx_mm = 0.2;  // rung_1
  found.members[2].dy_mm = 0.6;
  CertifyOptions options;
  options.table_z_mm = 500;
  const auto c = certify(part, found, options).front();
  const Vec2 start = found.pose * Vec2(-300, -110) + Vec2(0.3, 0.3);
  ASSERT_GE(c.path.size(), 21u);
  EXPECT_LT((c.path.front().head<2>() - start).norm(), 1e-9);
  EXPECT_DOUBLE_EQ(c.path.front().z(), 540);
  for (std::size_t k = 1; k < c.path.size(); ++k)
    EXPECT_LE((c.path[k] - c.path[k - 1]).norm(), kPathStepMm + 1e-9);
}

TEST(Certificate, SeamsFollowTheMeasuredTopAndAnIncredibleOneWeldsNothing) {
  const auto part = ladder();
  const auto found = found_ladder(part, {900, 30, 0});
  CertifyOptions options;
  options.table_z_mm = 500;
  MeasuredTop top;
  top.reference = {900, 30};
  top.plane.z_mm = options.table_z_mm + part.height_mm + 1.5;
  top.plane.slope_x = 0.004;
  options.top = top;
  for (const auto& c : certify(part, found, options)) {
    EXPECT_EQ(c.verdict, Verdict::Weld) << c.reason;
    for (const Eigen::Vector3d& p : c.path) EXPECT_NEAR(p.z(), 541.5 + 0.004 * (p.x() - 900), 1e-9);
  }
  options.top->plane.z_mm += 6;
  for (const auto& c : certify(part, found, options)) {
    EXPECT_EQ(c.verdict, Verdict::Reject);
    EXPECT_NE(c.reason.find("above where table and drawing put it"), std::string::npos) << c.reason;
  }
}

TEST(Certificate, AMemberTurnedAboutItsCentreMovesTheSeamAtItsEnd) {
  const auto part = ladder();
  auto found = found_ladder(part, {0, 0, 0});
  found.members[3].dtheta_rad = 0.004;  // rung_2: its lower end is 110 mm from its centre
  const auto certificates = certify(part, found, {});
  const auto& a2 = certificates[2];
  EXPECT_EQ(a2.name, "a2");
  EXPECT_NEAR(a2.path.front().x(), -20 + 0.5 * 0.004 * 110, 1e-9);
  EXPECT_NEAR(a2.path.front().y(), -110 - 0.5 * 0.004 * 20, 1e-9);
}

TEST(Certificate, WeldsInsideToleranceAreCertifiedWithTheirNumbers) {
  const auto part = ladder();
  for (const auto& c : certify(part, found_ladder(part, {900, 0, 0}), {})) {
    EXPECT_EQ(c.verdict, Verdict::Weld) << c.reason;
    EXPECT_LE(c.bound_mm, c.tolerance_mm);
    EXPECT_THAT(c.reason, HasSubstr(c.name));
  }
}

TEST(Certificate, AnUncertainMemberAsksForAScanOfItsSides) {
  const auto part = ladder();
  auto found = found_ladder(part, {900, 0, rad(5)});
  found.members[0].covariance(1, 1) = 1.0;  // rail_A across its axis
  const auto c = certify(part, found, {}).front();
  EXPECT_EQ(c.verdict, Verdict::Rescan);
  EXPECT_EQ(c.weakest, "rail_A");
  EXPECT_THAT(c.reason, HasSubstr("scan the long sides of rail_A again"));
  found.members[0].covariance(1, 1) = 0.01;
  found.members[2].covariance(1, 1) = 1.0;  // rung_1 along its axis
  EXPECT_THAT(certify(part, found, {}).front().reason, HasSubstr("scan the ends of rung_1 again"));
}

TEST(Certificate, AnUnmeasuredMemberIsNotTakenAsExact) {
  const auto part = ladder();
  auto found = found_ladder(part, {900, 0, 0});
  const double measured = certify(part, found, {}).front().bound_mm;
  found.members.erase(found.members.begin());
  const auto c = certify(part, found, {}).front();
  EXPECT_GT(c.bound_mm, measured + 0.2);
  EXPECT_EQ(c.weakest, "rail_A");
}

TEST(Certificate, AToleranceBelowTheRobotsOwnErrorIsRejected) {
  auto part = ladder();
  part.welds[0].tolerance_mm = 0.08;
  const auto c = certify(part, found_ladder(part, {900, 0, 0}), {}).front();
  EXPECT_EQ(c.verdict, Verdict::Reject);
  EXPECT_THAT(c.reason, HasSubstr("robot"));
}

TEST(Certificate, AKnownBiasIsAddedInFull) {
  const auto part = ladder();
  const auto found = found_ladder(part, {900, 0, 0});
  CertifyOptions options;
  const double without = certify(part, found, options).front().bound_mm;
  options.bias_mm = -0.2;
  EXPECT_NEAR(certify(part, found, options).front().bound_mm, without + 0.2, 1e-12);
}

TEST(Certificate, AnOpenJointIsRejectedAndNamed) {
  const auto part = ladder();
  auto found = found_ladder(part, {900, 0, rad(90)});
  // Part -y is Base +x here: rail_A away from the rungs.
  found.members[0].dx_mm = 1.8;
  const auto c = certify(part, found, {}).front();
  EXPECT_NEAR(c.gap_mm, 1.8, 1e-6);
  EXPECT_EQ(c.verdict, Verdict::Reject);
  EXPECT_THAT(c.reason, HasSubstr("rail_A"));
  EXPECT_THAT(c.reason, HasSubstr("rung_1"));
  EXPECT_THAT(c.reason, HasSubstr("1.80"));
  found.members[0].dx_mm = 1.1;  // within what the spread alone can make
  EXPECT_EQ(certify(part, found, {}).front().verdict, Verdict::Rescan);
  found.members[0].dx_mm = -1.8;
  const auto overlap = certify(part, found, {}).front();
  EXPECT_NEAR(overlap.gap_mm, -1.8, 1e-6);
  EXPECT_THAT(overlap.reason, HasSubstr("overlap"));
}

TEST(Certificate, ATurnedMemberOpensTheJointAtOneCorner) {
  const auto part = ladder();
  auto found = found_ladder(part, {900, 0, 0});
  found.members[3].dtheta_rad = 0.01;  // rung_2, 40 mm wide
  EXPECT_NEAR(certify(part, found, {})[2].gap_mm, 0.01 * 20, 1e-6);
}

TEST(Certificate, AStrayMemberIsRejected) {
  const auto part = ladder();
  auto found = found_ladder(part, {900, 0, 0});
  found.members[0].dx_mm = 4;  // along itself: no gap opens
  const auto c = certify(part, found, {}).front();
  EXPECT_EQ(c.verdict, Verdict::Reject);
  EXPECT_THAT(c.reason, HasSubstr("rail_A lies 4.0 mm beside the drawing"));
}

TEST(Certificate, NothingIsWeldedOnAnUntrustedPose) {
  const auto part = ladder();
  auto found = found_ladder(part, {900, 0, 0});
  found.verdict = Verdict::Rescan;
  found.reason = "scan rung_2 again";
  for (const auto& c : certify(part, found, {})) EXPECT_EQ(c.verdict, Verdict::Rescan);
  found.verdict = Verdict::Reject;
  for (const auto& c : certify(part, found, {})) {
    EXPECT_EQ(c.verdict, Verdict::Reject);
    EXPECT_TRUE(c.path.empty());
  }
  found.verdict = Verdict::Weld;
  found.covariance(0, 0) = std::nan("");
  for (const auto& c : certify(part, found, {})) EXPECT_EQ(c.verdict, Verdict::Reject);
}

TEST(Certificate, AVerticalSeamIsBoundInEveryDirection) {
  auto part = ladder();
  part.welds = {test::straight("v", "rail_A", "rung_1", {-260, -110, 0}, {-260, -110, 40})};
  auto found = found_ladder(part, {0, 0, 0});
  found.members[0].covariance(0, 0) = 0.04;
  const auto c = certify(part, found, {}).front();
  const double x_variance = 0.0025 + 0.25 * (0.04 + 0.008) + 0.0025;
  EXPECT_GT(c.bound_mm, kSigmas95 * std::sqrt(x_variance));
}

TEST(Decide, TakesTheGravestVerdictWithItsReason) {
  const auto part = ladder();
  const auto found = found_ladder(part, {900, 0, 0});
  auto certificates = certify(part, found, {});
  EXPECT_EQ(decide(found, certificates).verdict, Verdict::Weld);
  EXPECT_THAT(decide(found, certificates).reason, HasSubstr("6 of 6"));
  certificates[1].verdict = Verdict::Rescan;
  certificates[1].reason = "b1 rescan";
  certificates[4].verdict = Verdict::Reject;
  certificates[4].reason = "a3 reject";
  EXPECT_EQ(decide(found, certificates).verdict, Verdict::Reject);
  EXPECT_EQ(decide(found, certificates).reason, "a3 reject");
  auto untrusted = found;
  untrusted.verdict = Verdict::Rescan;
  untrusted.reason = "whole part";
  certificates.resize(1);
  EXPECT_EQ(decide(untrusted, certificates).reason, "whole part");
}

TEST(AssumeExact, FindsATighterToleranceThanTheRobotBeforeAnythingMoves) {
  auto part = ladder();
  part.welds[2].tolerance_mm = 0.05;
  const auto c = assume_exact(part, {900, 0, 0}, {});
  EXPECT_EQ(c[0].verdict, Verdict::Weld);
  EXPECT_EQ(c[2].verdict, Verdict::Reject);
}

}  // namespace
}  // namespace weldcell::weld
