// The arms of config/robots as a table, so that tests of the core parse no file.
#pragma once

#include <array>
#include <ostream>
#include <vector>

#include "weldcell/base/units.hpp"
#include "weldcell/kinematics/arm_model.hpp"

namespace weldcell::testing {

struct ArmRow {
  const char* name;
  double a1, a2, c1, c2, c3, c4;
  std::array<std::array<double, 2>, 6> limits_deg;
  std::array<double, 6> max_speed_deg_s;
};

inline void PrintTo(const ArmRow& row, std::ostream* out) { *out << row.name; }

inline kinematics::ArmModel arm_from(const ArmRow& row) {
  kinematics::ArmModel arm;
  arm.name = row.name;
  arm.a1 = row.a1, arm.a2 = row.a2, arm.c1 = row.c1, arm.c2 = row.c2, arm.c3 = row.c3, arm.c4 = row.c4;
  arm.offset[2] = rad(-90);
  for (std::size_t i = 0; i < 6; ++i) {
    arm.lower[i] = rad(row.limits_deg[i][0]);
    arm.upper[i] = rad(row.limits_deg[i][1]);
    arm.max_speed[i] = rad(row.max_speed_deg_s[i]);
  }
  return arm;
}

inline constexpr std::array<ArmRow, 7> kReferenceArms{{
    {"irb2600_12_165",
     150,
     -115,
     445,
     700,
     795,
     85,
     {{{-180, 180}, {-95, 155}, {-180, 75}, {-400, 400}, {-120, 120}, {-400, 400}}},
     {175, 175, 175, 360, 360, 500}},
    {"irb2600_12_185",
     150,
     -115,
     445,
     900,
     795,
     85,
     {{{-180, 180}, {-95, 155}, {-180, 75}, {-400, 400}, {-120, 120}, {-400, 400}}},
     {175, 175, 175, 360, 360, 500}},
    {"irb120_3_058",
     0,
     -70,
     290,
     270,
     302,
     72,
     {{{-165, 165}, {-110, 110}, {-110, 70}, {-160, 160}, {-120, 120}, {-400, 400}}},
     {250, 250, 250, 320, 320, 420}},
    {"irb1600_6_120",
     150,
     0,
     486.5,
     475,
     600,
     65,
     {{{-180, 180}, {-63, 110}, {-235, 55}, {-200, 200}, {-115, 115}, {-400, 400}}},
     {150, 160, 170, 320, 400, 450}},
    {"irb1600_8_145",
     150,
     0,
     486.5,
     700,
     600,
     65,
     {{{-180, 180}, {-90, 120}, {-245, 65}, {-200, 200}, {-115, 115}, {-400, 400}}},
     {180, 180, 185, 385, 400, 460}},
    {"irb4600_60_205",
     175,
     -175,
     495,
     900,
     960,
     135,
     {{{-180, 180}, {-90, 150}, {-180, 75}, {-400, 400}, {-125, 120}, {-400, 400}}},
     {175, 175, 175, 250, 250, 360}},
    {"irb6700_200_260",
     320,
     -200,
     780,
     1125,
     1142.5,
     200,
     {{{-170, 170}, {-65, 85}, {-180, 70}, {-300, 300}, {-130, 130}, {-360, 360}}},
     {110, 110, 110, 190, 150, 210}},
}};

inline kinematics::ArmModel irb2600_185() { return arm_from(kReferenceArms[1]); }

}  // namespace weldcell::testing
