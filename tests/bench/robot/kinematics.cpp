#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <random>
#include <sstream>

#include "bench/robot/parts.hpp"
#include "unit/kinematics/chain.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::bench {

namespace fs = std::filesystem;
using kinematics::ArmModel;
using kinematics::Joints;

ArmModel arm_of(const fs::path& path) {
  auto read = files::read_arm_file(path.string());
  if (const auto* faults = std::get_if<files::Faults>(&read)) {
    std::fprintf(stderr, "bench_robot: %s\n", files::text(*faults).c_str());
    std::exit(2);
  }
  return std::get<ArmModel>(read);
}

std::vector<fs::path> files_in(const fs::path& folder, const char* extension) {
  std::vector<fs::path> out;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == extension) out.push_back(entry.path());
  }
  std::sort(out.begin(), out.end());
  return out;
}

namespace {

constexpr int kSets = 10000;

std::vector<std::vector<double>> rows_of(const fs::path& path) {
  std::ifstream file(path);
  std::string line, field;
  std::vector<std::vector<double>> out;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::stringstream fields(line);
    out.emplace_back();
    while (std::getline(fields, field, ',')) out.back().push_back(std::stod(field));
  }
  return out;
}

Joints joints_of(const std::vector<double>& row) {
  Joints q{};
  for (std::size_t i = 0; i < 6; ++i) q[i] = rad(row[i]);
  return q;
}

double angle_deg(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  // Through the antisymmetric part: acos would lose half of the digits near zero.
  const Eigen::Matrix3d d = a.transpose() * b;
  const Eigen::Vector3d v(d(2, 1) - d(1, 2), d(0, 2) - d(2, 0), d(1, 0) - d(0, 1));
  return deg(std::atan2(v.norm() / 2, (d.trace() - 1) / 2));
}

}  // namespace

void against_references(std::vector<Row>& rows) {
  double worst_mm = 0, worst_deg = 0;
  int vectors = 0, models = 0, wrong_configurations = 0;
  for (const fs::path& path : files_in(WELDCELL_TEST_DATA "/kinematics", ".csv")) {
    const ArmModel arm = arm_of(fs::path(WELDCELL_CONFIG "/robots") / (path.stem().string() + ".yaml"));
    ++models;
    for (const auto& row : rows_of(path)) {
      const auto pose = kinematics::forward(arm, joints_of(row));
      const Eigen::Quaterniond q(row[9], row[10], row[11], row[12]);
      worst_mm = std::max(worst_mm, (pose.position_mm() - Eigen::Vector3d(row[6], row[7], row[8])).norm());
      worst_deg = std::max(worst_deg, angle_deg(pose.rotation(), q.normalized().toRotationMatrix()));
      ++vectors;
    }
    for (const auto& row : rows_of(path.parent_path() / "conf" / path.filename())) {
      const auto own = kinematics::configuration(arm, joints_of(row));
      const kinematics::Configuration expected{static_cast<int>(row[6]), static_cast<int>(row[7]),
                                               static_cast<int>(row[8]), static_cast<int>(row[9])};
      wrong_configurations += own == expected ? 0 : 1;
    }
  }
  rows.push_back({"reference vectors (of " + std::to_string(models) + " models)",
                  static_cast<double>(vectors), "", NAN, NAN, Better::None});
  rows.push_back({"FK against them, worst position", worst_mm, "mm", NAN, 1e-6});
  rows.push_back({"FK against them, worst rotation", worst_deg, "deg", NAN, 1e-6});
  rows.push_back(
      {"configurations unlike the reference", static_cast<double>(wrong_configurations), "", NAN, 0});
}

namespace {

double since_us(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace

void against_chains(std::vector<Row>& rows) {
  double worst_mm = 0, worst_deg = 0, rounded_mm = 0;
  int models = 0;
  std::mt19937_64 random(kSeed);
  for (const fs::path& path : files_in(WELDCELL_TEST_DATA "/kinematics/chains", ".csv")) {
    const testing::Chain chain = testing::read_chain(path);
    const ArmModel arm = arm_of(fs::path(WELDCELL_CONFIG "/robots") / (path.stem().string() + ".yaml"));
    ++models;
    for (int k = 0; k < kSets; ++k) {
      Joints q{};
      for (std::size_t i = 0; i < 6; ++i)
        q[i] = std::uniform_real_distribution(arm.lower[i], arm.upper[i])(random);
      Joints serial = q;
      if (arm.j3_j2_coupling != 0) serial[2] = q[2] - q[1];
      const Eigen::Isometry3d theirs = testing::forward(chain, serial);
      const auto own = kinematics::forward(arm, q);
      const double off_mm = (own.position_mm() - theirs.translation()).norm();
      (chain.rounded_mm > 0 ? rounded_mm : worst_mm) =
          std::max(chain.rounded_mm > 0 ? rounded_mm : worst_mm, off_mm);
      worst_deg = std::max(worst_deg, angle_deg(own.rotation(), theirs.linear()));
    }
  }
  rows.push_back(
      {"FK, published chains of joints: models", static_cast<double>(models), "", NAN, 12, Better::Higher});
  rows.push_back({"FK, published chains: position, worst", worst_mm, "mm", NAN, 1e-6});
  rows.push_back({"FK, published chains: orientation, worst", worst_deg, "deg", NAN, 1e-6});
  rows.push_back({"FK, chain rounded to 0.5 mm (IRB 6640): position", rounded_mm, "mm", NAN, 0.5 + 1e-6});
}

void against_itself(std::vector<Row>& rows) {
  int missing = 0, sets = 0, models = 0;
  double worst_pose_mm = 0, fk_us = 0, ik_us = 0;
  for (const fs::path& path : files_in(WELDCELL_CONFIG "/robots", ".yaml")) {
    const ArmModel arm = arm_of(path);
    ++models;
    std::mt19937_64 random(kSeed);
    std::vector<Joints> q(kSets);
    for (Joints& joints : q) {
      for (std::size_t i = 0; i < 6; ++i)
        joints[i] = std::uniform_real_distribution<double>(arm.lower[i], arm.upper[i])(random);
    }
    std::vector<Transform<Base, Flange>> poses(q.size());
    auto begin = std::chrono::steady_clock::now();
    for (std::size_t n = 0; n < q.size(); ++n) poses[n] = kinematics::forward(arm, q[n]);
    fk_us += since_us(begin);
    begin = std::chrono::steady_clock::now();
    kinematics::Branches branches;
    double sum = 0;
    for (std::size_t n = 0; n < q.size(); ++n) {
      kinematics::inverse_branches(arm, poses[n], q[n], branches);
      sum += branches.joints[0][0];
    }
    ik_us += since_us(begin);
    if (!std::isfinite(sum)) std::fprintf(stderr, "%s: inverse gave no number\n", arm.name.c_str());
    for (std::size_t n = 0; n < q.size(); ++n) {
      bool contained = false;
      for (const Joints& s : kinematics::inverse(arm, poses[n], q[n])) {
        double worst = 0;
        for (std::size_t i = 0; i < 6; ++i) worst = std::max(worst, std::abs(s[i] - q[n][i]));
        contained = contained || worst < 1e-6;
        worst_pose_mm = std::max(worst_pose_mm,
                                 (kinematics::forward(arm, s).position_mm() - poses[n].position_mm()).norm());
      }
      missing += contained ? 0 : 1;
      ++sets;
    }
  }
  rows.push_back(
      {"random joint sets (of " + std::to_string(models) + " models, seed " + std::to_string(kSeed) + ")",
       static_cast<double>(sets), "", NAN, NAN, Better::None});
  rows.push_back({"IK(FK(q)) contains q", 100.0 * (sets - missing) / sets, "%", NAN, 100, Better::Higher});
  rows.push_back({"FK of any IK solution off its pose, worst", worst_pose_mm, "mm", NAN, 1e-6});
  rows.push_back({"FK time", fk_us / sets, "us", NAN, NAN, Better::None});
  rows.push_back({"IK time, all branches", ik_us / sets, "us", NAN, NAN, Better::None});
}

}  // namespace weldcell::bench
