// Torch paths over certified seams and the RAPID module that welds them. Pure.
#pragma once

#include <string>
#include <vector>

#include "weldcell/cell/cell_setup.hpp"
#include "weldcell/weld/certificate.hpp"

namespace weldcell::weld {

/// One torch pose with the arm's joints for it.
struct TorchTarget {
  Transform<Base, Torch> T_base_torch;
  kinematics::Joints joints{};
  kinematics::Configuration configuration;
};

struct TorchPath {
  std::string name;
  std::vector<TorchTarget> targets;  ///< over, approach, seam points (at most 2 mm apart), retract, away
  std::size_t first_seam = 0, last_seam = 0;
};

/// Orientation of the torch over a seam: T_base_torch with the TCP (wire tip) at `tip`, +Z against the
/// approach. The body leans from the table's normal by the work angle to the left of travel, and by the
/// travel angle backwards, so that the wire points ahead (pushing). At roll 0 the torch's +X is the direction
/// of travel, seen along the wire; roll turns about +Z. `travel` must not be vertical.
Transform<Base, Torch> torch_frame(const Eigen::Vector3d& tip, const Eigen::Vector3d& travel,
                                   double work_angle_rad, double travel_angle_rad, double roll_rad);

/// Chooses the roll about the wire so that the whole seam is reached in one branch, away from limits and
/// singularity. Every certificate must say weld ("weld.not_certified" otherwise), every name must be a weld
/// of the workpiece. Error "weld.unreachable" names the weld and the point; "weld.vertical" a seam steeper
/// than 60 deg; "weld.air_move" a way between seams on which a tool would come down to the members.
Result<std::vector<TorchPath>> plan_torch(const cell::CellSetup& cell, const workpiece::Workpiece& workpiece,
                                          const std::vector<WeldCertificate>& certificates,
                                          const kinematics::Joints& near);

/// What the module's text needs beside the paths. Arc values depend on the power source: an integrator sets
/// them once.
struct RapidOptions {
  std::string program_version;
  double preflow_s = 0.5, postflow_s = 0.5, crater_fill_s = 0.3;
  double voltage_v = 24, wirefeed = 130;  ///< in the units of the controller's arc system
};

/// RAPID text (RW6, ISO-8859-1 safe) of module `WeldcellJob`: PERS num nSeamsDone, nSeamsBegun, nSeamsToSkip,
/// nSeamsAllowed and PROC WeldcellWeld() that leaves out the first nSeamsToSkip seams, with MoveAbsJ, MoveL,
/// ArcLStart, ArcL, ArcLEnd. Before each seam it waits until nSeamsAllowed exceeds nSeamsDone, and exits
/// after 10 s without. Targets are absolute in Base (the work object is the identity). Full literals,
/// identifiers
/// <= 32, lines < 255.
std::string rapid_module(const cell::CellSetup& cell, const std::string& job,
                         const std::vector<TorchPath>& paths, const RapidOptions& options = {});

}  // namespace weldcell::weld
