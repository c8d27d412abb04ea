// Every arm of config/robots against the chain of joints that somebody else published for it.
#include <gtest/gtest.h>

#include <random>

#include "unit/kinematics/chain.hpp"
#include "weldcell/files/cell_file.hpp"

namespace weldcell::files {
namespace {

namespace fs = std::filesystem;
using kinematics::Joints;

TEST(ArmChains, EveryArmFileHasAnIndependentReference) {
  for (const auto& entry : fs::directory_iterator(WELDCELL_CONFIG "/robots")) {
    const std::string name = entry.path().stem().string();
    const fs::path data = WELDCELL_TEST_DATA "/kinematics";
    EXPECT_TRUE(fs::exists(data / (name + ".csv")) || fs::exists(data / "chains" / (name + ".csv"))) << name;
  }
}

TEST(ArmChains, ForwardKinematicsAgreeWithThePublishedChains) {
  constexpr int kSets = 1000;
  const unsigned seed = 20261126;
  std::mt19937 random(seed);
  int chains = 0;
  for (const auto& entry : fs::directory_iterator(WELDCELL_TEST_DATA "/kinematics/chains")) {
    const std::string name = entry.path().stem().string();
    const testing::Chain chain = testing::read_chain(entry.path());
    ASSERT_GE(chain.links.size(), 6u) << name;
    auto read = read_arm_file(WELDCELL_CONFIG "/robots/" + name + ".yaml");
    const auto* arm = std::get_if<kinematics::ArmModel>(&read);
    ASSERT_NE(arm, nullptr) << name;
    double worst_mm = 0, worst_rad = 0;
    for (int k = 0; k < kSets; ++k) {
      Joints q{};
      for (std::size_t i = 0; i < 6; ++i)
        q[i] = std::uniform_real_distribution(arm->lower[i], arm->upper[i])(random);
      Joints serial = q;
      if (arm->j3_j2_coupling != 0) serial[2] = q[2] - q[1];  // what a level linkage does
      const Eigen::Isometry3d theirs = testing::forward(chain, serial);
      const auto own = kinematics::forward(*arm, q);
      worst_mm = std::max(worst_mm, (own.position_mm() - theirs.translation()).norm());
      worst_rad = std::max(worst_rad, (own.rotation() - theirs.linear()).norm());
    }
    EXPECT_LT(worst_mm, chain.rounded_mm + 1e-6) << name << ", seed " << seed;
    EXPECT_LT(worst_rad, 1e-9) << name << ", seed " << seed;
    std::printf("  %-20s %-12s worst %.2g mm, %.2g rad of %d joint sets\n", name.c_str(), chain.kind.c_str(),
                worst_mm, worst_rad, kSets);
    ++chains;
  }
  EXPECT_EQ(chains, 12);
}

}  // namespace
}  // namespace weldcell::files
