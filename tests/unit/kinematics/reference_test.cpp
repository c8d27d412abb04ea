// Joints and poses computed from the makers' URDF chains, and configurations from ABB's definition.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "unit/kinematics/robots.hpp"

namespace weldcell::kinematics {
namespace {

std::vector<std::vector<double>> read_rows(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  std::vector<std::vector<double>> rows;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::stringstream fields(line);
    std::string field;
    rows.emplace_back();
    while (std::getline(fields, field, ',')) rows.back().push_back(std::stod(field));
  }
  return rows;
}

Joints joints_of(const std::vector<double>& row) {
  Joints q{};
  for (std::size_t i = 0; i < 6; ++i) q[i] = rad(row[i]);
  return q;
}

class Reference : public ::testing::TestWithParam<testing::ArmRow> {};

TEST_P(Reference, ForwardAndInverseAgree) {
  const ArmModel arm = testing::arm_from(GetParam());
  const auto rows = read_rows(std::string(WELDCELL_TEST_DATA "/kinematics/") + arm.name + ".csv");
  ASSERT_EQ(rows.size(), 200u);
  for (const auto& row : rows) {
    ASSERT_EQ(row.size(), 13u);
    const Joints q = joints_of(row);
    Transform<Base, Flange> pose;
    pose.iso.translation() = Eigen::Vector3d(row[6], row[7], row[8]);
    pose.iso.linear() = Eigen::Quaterniond(row[9], row[10], row[11], row[12]).normalized().toRotationMatrix();
    const Transform<Base, Flange> own = forward(arm, q);
    EXPECT_LT((own.position_mm() - pose.position_mm()).norm(), 1e-6) << row[0] << " " << row[1];
    EXPECT_LT((own.rotation() - pose.rotation()).norm(), 1e-6) << row[0] << " " << row[1];

    const std::vector<Joints> found = inverse(arm, own, q);
    ASSERT_FALSE(found.empty());
    for (std::size_t i = 0; i < 6; ++i)
      EXPECT_NEAR(found.front()[i], q[i], 1e-6) << arm.name << " J" << i + 1;
  }
}

TEST_P(Reference, ConfigurationAgrees) {
  const ArmModel arm = testing::arm_from(GetParam());
  const auto rows = read_rows(std::string(WELDCELL_TEST_DATA "/kinematics/conf/") + arm.name + ".csv");
  ASSERT_EQ(rows.size(), 200u);
  for (const auto& row : rows) {
    ASSERT_EQ(row.size(), 10u);
    const Configuration expected{static_cast<int>(row[6]), static_cast<int>(row[7]), static_cast<int>(row[8]),
                                 static_cast<int>(row[9])};
    const Configuration own = configuration(arm, joints_of(row));
    EXPECT_EQ(own, expected) << arm.name << ": " << own.cf1 << own.cf4 << own.cf6 << own.cfx;
  }
}

INSTANTIATE_TEST_SUITE_P(Arms, Reference, ::testing::ValuesIn(testing::kReferenceArms),
                         [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace weldcell::kinematics
