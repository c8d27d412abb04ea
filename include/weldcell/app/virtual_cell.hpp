// A whole job in virtual time: the daemon's brain and EGM session against the simulated controller and laser,
// byte for byte, without sockets or sleeping. Deterministic for a seed. Single-threaded.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "weldcell/files/cell_file.hpp"
#include "weldcell/job/cell.hpp"
#include "weldcell/sim/controller.hpp"
#include "weldcell/sim/scene.hpp"

namespace weldcell::app {

struct VirtualJob {
  job::JobOrder order;
  workpiece::Workpiece workpiece;
  std::string resident_module;  ///< text of WeldcellEgm.mod
  double give_up_s = 1200;      ///< virtual time
};

struct VirtualOutcome {
  bool finished = false, accepted = false;
  std::string verdict, reason, cause;
  std::optional<Pose2> found;
  Pose2 truth;
  Vec2 centroid_error_mm = Vec2::Zero();  ///< found - truth at the template's centroid, Base axes
  double theta_error_rad = 0;
  std::vector<weld::WeldCertificate> certificates;
  std::vector<double> seam_error_mm;  ///< torch's worst lateral error on the true seam, one a welded seam
  double scan_s = 0;                  ///< virtual time of all passes
  double virtual_s = 0;
  int passes = 0, points = 0;
  std::shared_ptr<const job::Solution> solution;  ///< of the last localization; null when there was none
  std::vector<std::string> log;
};

/// Runs one job to its end, a person arming, starting and confirming at once.
VirtualOutcome run_virtual(const files::CellConfig& config, const sim::Scene& scene, const VirtualJob& job);

}  // namespace weldcell::app
