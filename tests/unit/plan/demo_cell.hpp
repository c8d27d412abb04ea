// The demonstration cell and its two weldments, built by hand: tests of the core read no files.
#pragma once

#include "unit/kinematics/robots.hpp"
#include "weldcell/cell/cell_setup.hpp"
#include "weldcell/workpiece/workpiece.hpp"

namespace weldcell::testing {

inline cell::CellSetup demo_cell() {
  cell::CellSetup cell;
  cell.name = "test cell";
  cell.arm = irb2600_185();
  cell.home = {0, 0, 0, 0, rad(90), 0};
  cell.laser.T_flange_laser.iso.translation() = Eigen::Vector3d(0, -80, 200);
  cell.projector.T_flange_projector.iso.translation() = Eigen::Vector3d(0, 90, 60);
  cell.torch.T_flange_torch.iso.translation() = Eigen::Vector3d(320, 0, 332);
  cell.torch.T_flange_torch.iso.linear() =
      Eigen::AngleAxisd(rad(45), Eigen::Vector3d::UnitY()).toRotationMatrix();
  cell.table.z_mm = 500;
  cell.table.area = {{400, -750}, {1500, 750}};
  cell.limits.joint_acceleration = {8, 8, 8, 20, 20, 20};
  cell.limits.joint_jerk = {80, 80, 80, 200, 200, 200};
  return cell;
}

inline Polygon rectangle(double x0, double y0, double x1, double y1) {
  return {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
}

inline workpiece::Weld weld_up(const char* name, const char* rail, const char* rung, double x0, double x1,
                               double y) {
  workpiece::Weld weld;
  weld.name = name;
  weld.joins = {rail, rung};
  weld.start = {x0, y, 40};
  weld.pieces = {{false, Eigen::Vector3d::Zero(), {x1, y, 40}}};
  return weld;
}

/// 1200 x 600, two rails and four rungs of 40 x 40 tube, butt joints.
inline workpiece::Workpiece ladder() {
  workpiece::Workpiece w;
  w.name = "ladder";
  w.height_mm = 40;
  w.members.push_back({"rail_L", "1", rectangle(0, 0, 1200, 40), 4});
  w.members.push_back({"rail_R", "2", rectangle(0, 560, 1200, 600), 4});
  int rung = 0;
  for (const double x : {0.0, 380.0, 760.0, 1160.0}) {
    const std::string name = "rung_" + std::to_string(++rung);
    w.members.push_back({name, std::to_string(rung + 2), rectangle(x, 40, x + 40, 560), 4});
    w.welds.push_back(weld_up("low", "rail_L", name.c_str(), x, x + 40, 40));
    w.welds.push_back(weld_up("high", "rail_R", name.c_str(), x, x + 40, 560));
  }
  return w;
}

/// 800 x 500 frame with mitred corners.
inline workpiece::Workpiece mitre() {
  workpiece::Workpiece w;
  w.name = "mitre";
  w.height_mm = 40;
  w.members.push_back({"side_1", "1", {{0, 0}, {800, 0}, {760, 40}, {40, 40}}, 4});
  w.members.push_back({"side_2", "2", {{800, 0}, {800, 500}, {760, 460}, {760, 40}}, 4});
  w.members.push_back({"side_3", "3", {{800, 500}, {0, 500}, {40, 460}, {760, 460}}, 4});
  w.members.push_back({"side_4", "4", {{0, 500}, {0, 0}, {40, 40}, {40, 460}}, 4});
  return w;
}

/// Part origins that put the weldments' middles over (950, 0), long axis along Base Y.
inline constexpr Pose2 kLadderPose{1250, -600, kPi / 2};
inline constexpr Pose2 kMitrePose{1200, -400, kPi / 2};

}  // namespace weldcell::testing
