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
  std::vector<TorchTarget> targets;  ///< approach, seam points, retract
  std::size_t first_seam = 0, last_seam = 0;
};

/// Chooses the roll about the wire so that the whole seam is reached in one branch, away from limits and singularity.
/// Error "weld.unreachable" names the weld and the point.
Result<std::vector<TorchPath>> plan_torch(const cell::CellSetup& cell, const workpiece::Workpiece& workpiece,
                                          const std::vector<WeldCertificate>& certificates,
                                          const kinematics::Joints& near);

/// RAPID text (RW6, ISO-8859-1 safe) of module `WeldcellJob`: PERS num nSeamsDone, PROC WeldcellWeld() that starts
/// after seam `skip_seams`, with MoveAbsJ, MoveJ, ArcLStart, ArcL, ArcLEnd, MoveL. Full literals, identifiers <= 32.
std::string rapid_module(const cell::CellSetup& cell, const std::string& job, const std::vector<TorchPath>& paths);

}  // namespace weldcell::weld
