// An IRB 2600-12/1.85 with a 45 deg torch, a laser and a projector on one flange, for the weld tests.
#pragma once

#include "weldcell/base/units.hpp"
#include "weldcell/cell/cell_setup.hpp"

namespace weldcell::weld::test {

inline kinematics::ArmModel irb2600_185() {
  kinematics::ArmModel arm;
  arm.name = "irb2600_12_185";
  arm.a1 = 150, arm.a2 = -115, arm.c1 = 445, arm.c2 = 900, arm.c3 = 795, arm.c4 = 85;
  arm.offset[2] = rad(-90);
  const double lower[] = {-180, -95, -180, -400, -120, -400}, upper[] = {180, 155, 75, 400, 120, 400};
  const double speed[] = {175, 175, 175, 360, 360, 500};
  for (std::size_t i = 0; i < 6; ++i) {
    arm.lower[i] = rad(lower[i]);
    arm.upper[i] = rad(upper[i]);
    arm.max_speed[i] = rad(speed[i]);
  }
  return arm;
}

inline cell::CellSetup test_cell() {
  cell::CellSetup c;
  c.name = "test";
  c.arm = irb2600_185();
  c.home = {0, rad(-20), rad(10), 0, rad(60), 0};
  c.table.z_mm = 500;
  c.torch.T_flange_torch.iso.translate(Eigen::Vector3d(320, 0, 332));
  c.torch.T_flange_torch.iso.rotate(Eigen::AngleAxisd(rad(45), Eigen::Vector3d::UnitY()));
  c.laser.T_flange_laser.iso.translate(Eigen::Vector3d(-60, 80, 60));
  c.projector.T_flange_projector.iso.translate(Eigen::Vector3d(-60, -80, 60));
  return c;
}

}  // namespace weldcell::weld::test
