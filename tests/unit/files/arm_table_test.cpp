// Every arm of the table of supported arms has its file under config/robots, and the file says what the table
// says. Lengths from URDF chains and simulation presets of public sources, limits as their makers' sheets
// have them: the IRB 2600's J2 is -95..155 and J3 -180..75 deg (one public URDF has the first turned round),
// and the limits of the two IRB 1600 are not exchanged. Speeds of the ID arms that no source gives are those
// of the file's own source line.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>

#include "weldcell/base/units.hpp"
#include "weldcell/files/arm_file.hpp"
#include "weldcell/files/cell_file.hpp"

namespace weldcell::files {
namespace {

using Range = std::array<double, 2>;

struct ArmOfTable {
  const char* name;
  double reach_m;  ///< in the arm's name; 0: the name has none that can be computed
  double a1, a2, c1, c2, c3, c4;
  std::array<Range, 6> limits_deg;
  std::array<double, 6> speed_deg_s;  ///< zeros: no source gives them
  bool parallelogram = false;
};

constexpr std::array<Range, 6> k2600{
    {{-180, 180}, {-95, 155}, {-180, 75}, {-400, 400}, {-120, 120}, {-400, 400}}};
constexpr std::array<Range, 6> k2600Id{
    {{-180, 180}, {-95, 155}, {-180, 75}, {-175, 175}, {-120, 120}, {-400, 400}}};
constexpr std::array<Range, 6> k4600{
    {{-180, 180}, {-90, 150}, {-180, 75}, {-400, 400}, {-125, 120}, {-400, 400}}};
constexpr std::array<double, 6> kSpeed2600{175, 175, 175, 360, 360, 500},
    kSpeed4600{175, 175, 175, 250, 250, 360};
constexpr std::array<double, 6> kSpeed1200{288, 240, 300, 400, 405, 600};

const ArmOfTable kTable[] = {
    {"irb2600_12_165", 1.65, 150, -115, 445, 700, 795, 85, k2600, kSpeed2600},
    {"irb2600_20_165", 1.65, 150, -115, 445, 700, 795, 85, k2600, kSpeed2600},
    {"irb2600_12_185", 1.85, 150, -115, 445, 900, 795, 85, k2600, kSpeed2600},
    {"irb2600id_15_185", 1.85, 150, -150, 445, 900, 786, 135, k2600Id, kSpeed2600},
    {"irb2600id_8_200", 2.00, 150, -150, 445, 900, 938, 200, k2600Id, kSpeed2600},
    {"irb120_3_058",
     0.58,
     0,
     -70,
     290,
     270,
     302,
     72,
     {{{-165, 165}, {-110, 110}, {-110, 70}, {-160, 160}, {-120, 120}, {-400, 400}}},
     {250, 250, 250, 320, 320, 420}},
    {"irb1200_5_090",
     0.90,
     0,
     -42,
     399.1,
     448,
     451,
     82,
     {{{-170, 170}, {-100, 130}, {-200, 70}, {-270, 270}, {-130, 130}, {-360, 360}}},
     kSpeed1200},
    {"irb1200_7_070",
     0.70,
     0,
     -42,
     399.1,
     350,
     351,
     82,
     {{{-170, 170}, {-100, 135}, {-200, 70}, {-270, 270}, {-130, 130}, {-360, 360}}},
     kSpeed1200},
    {"irb1600_6_120",
     1.20,
     150,
     0,
     486.5,
     475,
     600,
     65,
     {{{-180, 180}, {-63, 110}, {-235, 55}, {-200, 200}, {-115, 115}, {-400, 400}}},
     {150, 160, 170, 320, 400, 450}},
    {"irb1600_10_145",
     1.45,
     150,
     0,
     486.5,
     700,
     600,
     65,
     {{{-180, 180}, {-90, 120}, {-245, 65}, {-200, 200}, {-115, 115}, {-400, 400}}},
     {180, 180, 185, 385, 400, 460}},
    {"irb2400_10_155",
     1.55,
     100,
     -135,
     615,
     705,
     755,
     85,
     {{{-180, 180}, {-100, 110}, {-60, 65}, {-200, 200}, {-120, 120}, {-400, 400}}},
     {150, 150, 150, 360, 360, 450},
     true},
    {"irb4600_60_205", 2.05, 175, -175, 495, 900, 960, 135, k4600, kSpeed4600},
    {"irb4600_40_255", 2.55, 175, -175, 495, 1095, 1270, 135, k4600, kSpeed4600},
    {"irb4600_20_250", 2.50, 175, -175, 495, 1095, 1230.5, 85, k4600, kSpeed2600},
    {"irb6640_185_280",
     2.80,
     320,
     -200,
     780,
     1075,
     1392.5,
     200,
     {{{-170, 170}, {-65, 85}, {-180, 70}, {-300, 300}, {-120, 120}, {-360, 360}}},
     {100, 90, 90, 170, 140, 190}},
    {"irb6700_200_260",
     2.60,
     320,
     -200,
     780,
     1125,
     1142.5,
     200,
     {{{-170, 170}, {-65, 85}, {-180, 70}, {-300, 300}, {-130, 130}, {-360, 360}}},
     {110, 110, 110, 190, 150, 210}},
    {"irb1520id_4_150",
     1.50,
     160,
     -200,
     453,
     590,
     723,
     200,
     {{{-170, 170}, {-90, 150}, {-100, 80}, {-155, 155}, {-135, 135}, {-200, 200}}},
     {}},
    {"irb1660id_4_155",
     1.55,
     150,
     -110,
     486.5,
     700,
     678,
     135,
     {{{-180, 180}, {-90, 150}, {-238, 79}, {-175, 175}, {-120, 120}, {-400, 400}}},
     {}},
};

const std::filesystem::path kRobots = WELDCELL_CONFIG "/robots";

kinematics::ArmModel shipped(const std::string& name) {
  auto read = read_arm_file((kRobots / (name + ".yaml")).string());
  if (const auto* faults = std::get_if<Faults>(&read)) {
    ADD_FAILURE() << text(*faults);
    return {};
  }
  return std::get<kinematics::ArmModel>(read);
}

class ArmTable : public ::testing::TestWithParam<ArmOfTable> {};
INSTANTIATE_TEST_SUITE_P(Arms, ArmTable, ::testing::ValuesIn(kTable),
                         [](const auto& instance) { return std::string(instance.param.name); });

TEST_P(ArmTable, FileSaysWhatTheTableSays) {
  const ArmOfTable& row = GetParam();
  const kinematics::ArmModel arm = shipped(row.name);
  EXPECT_EQ(arm.name, row.name);
  EXPECT_EQ(arm.a1, row.a1);
  EXPECT_EQ(arm.a2, row.a2);
  EXPECT_EQ(arm.b, 0);
  EXPECT_EQ(arm.c1, row.c1);
  EXPECT_EQ(arm.c2, row.c2);
  EXPECT_EQ(arm.c3, row.c3);
  EXPECT_EQ(arm.c4, row.c4);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(deg(arm.offset[i]), i == 2 ? -90 : 0, 1e-12) << "J" << i + 1;
    EXPECT_EQ(arm.sign[i], 1) << "J" << i + 1;
    EXPECT_NEAR(deg(arm.lower[i]), row.limits_deg[i][0], 1e-9) << "J" << i + 1;
    EXPECT_NEAR(deg(arm.upper[i]), row.limits_deg[i][1], 1e-9) << "J" << i + 1;
    if (row.speed_deg_s[i] > 0) {
      EXPECT_NEAR(deg(arm.max_speed[i]), row.speed_deg_s[i], 1e-9) << "J" << i + 1;
    }
    EXPECT_GT(arm.max_speed[i], 0) << "J" << i + 1;
  }
  EXPECT_EQ(arm.j3_j2_coupling, row.parallelogram ? 1 : 0);
}

TEST_P(ArmTable, ReachIsTheOneInTheName) {
  const ArmOfTable& row = GetParam();
  const kinematics::ArmModel arm = shipped(row.name);
  // Wrist centre of the stretched arm. Names round.
  EXPECT_NEAR((arm.a1 + arm.c2 + std::hypot(arm.a2, arm.c3)) * 1e-3, row.reach_m, 0.03);
}

TEST_P(ArmTable, ZeroPostureHasTheFlangeAhead) {
  const kinematics::ArmModel arm = shipped(GetParam().name);
  const auto pose = kinematics::forward(arm, {});
  EXPECT_NEAR(pose.position_mm().x(), arm.a1 + arm.c3 + arm.c4, 1e-9);
  EXPECT_NEAR(pose.position_mm().y(), 0, 1e-9);
  EXPECT_NEAR(pose.position_mm().z(), arm.c1 + arm.c2 - arm.a2, 1e-9);
  const Eigen::Quaterniond q(pose.rotation());
  EXPECT_NEAR(std::abs(q.dot(Eigen::Quaterniond(std::sqrt(0.5), 0, std::sqrt(0.5), 0))), 1, 1e-12);
}

TEST(ArmFiles, AreAllInTheTable) {
  std::set<std::string> known{"irb1600_8_145"};  // the 10 kg arm's lengths with another load
  for (const ArmOfTable& row : kTable) known.insert(row.name);
  for (const auto& file : std::filesystem::directory_iterator(kRobots))
    EXPECT_TRUE(known.contains(file.path().stem().string())) << file.path();
}

}  // namespace
}  // namespace weldcell::files
