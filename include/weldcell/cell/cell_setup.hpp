// What one robot cell is made of: arm, tools, sensor, projector, table and limits, as the cell file states
// them. Pure.
#pragma once

#include <array>
#include <string>

#include "weldcell/geometry/plane.hpp"
#include "weldcell/geometry/transform.hpp"
#include "weldcell/kinematics/arm_model.hpp"

namespace weldcell::cell {

struct LaserSetup {
  Transform<Flange, Laser> T_flange_laser;
  double start_of_range_mm = 130;  ///< distance reading 0 lies this far along the beam from the Laser origin
  double range_mm = 200;           ///< measuring range
  double rate_hz = 5000;
  double latency_ms = 2.7;  ///< pipeline + transport: reading's time stamp minus mid-exposure
  double latency_sigma_ms = 0.5;
  double spot_mm = 1.1;            ///< beam diameter, 1/e2
  double triangulation_rad = 0.3;  ///< angle between beam and receiver at mid range
  double noise_mm = 0.1;           ///< 1 sigma of one reading
  double standoff_mm = 230;        ///< distance from the Laser origin to the part's top while scanning
};

struct ProjectorSetup {
  Transform<Flange, Projector> T_flange_projector;
  int width_px = 848, height_px = 480;
  double fx_px = 1071, fy_px = 1071, cx_px = 424, cy_px = 240;
  double k1 = 0, k2 = 0;
  double distance_mm = 800;  ///< preferred distance to the table
};

struct TorchSetup {
  Transform<Flange, Torch> T_flange_torch;
  std::array<double, 3> center_of_mass_mm{0, 0, 100};
  double mass_kg = 4.5;
};

struct TableSetup {
  double z_mm = 500;  ///< table top in Base
  Box2 area;          ///< where parts may lie, Base mm
};

/// Limits for every streamed motion, whatever the plan says.
struct MotionLimits {
  double joint_speed_fraction = 0.5;        ///< of the arm's maximum, per axis
  kinematics::Joints joint_acceleration{};  ///< rad/s2
  kinematics::Joints joint_jerk{};          ///< rad/s3
  double natural_frequency_hz = 0;  ///< of arm and head; 0: unknown, jerk phases as short as the limit
  double line_acceleration_mm_s2 = 1500;
  double line_jerk_mm_s3 = 15000;
  double limit_margin_rad = 0.0175;
  double min_sin_j5 = 0.17;  ///< |sin J5| of scan and weld poses
};

struct EgmSetup {
  double cycle_ms = 4.0;
  double comm_timeout_s = 0.5;
  double max_speed_deviation_deg_s = 90;
  double low_pass_hz = 100;  ///< of the controller's own filter, as EGMActJoint asks for it
};

struct WeldSetup {
  double speed_mm_s = 10;
  double approach_mm = 50;
  double stick_out_mm = 15;
  double air_speed_mm_s = 500;
  std::string torch_tool = "tWeldcellTorch";
};

/// Everything that planning, sensing and welding need to know of the cell. Devices' addresses are not here.
struct CellSetup {
  std::string name;
  kinematics::ArmModel arm;
  kinematics::Joints home{};
  LaserSetup laser;
  ProjectorSetup projector;
  TorchSetup torch;
  TableSetup table;
  MotionLimits limits;
  EgmSetup egm;
  WeldSetup weld;
};

}  // namespace weldcell::cell
