// What a job file asks for. Pure.
#pragma once

#include <optional>
#include <string>

#include "weldcell/plan/scan_plan.hpp"

namespace weldcell::job {

struct Acceptance {
  double max_mean_error_mm = 2.5;
  double max_offset_mm = 50;
  double max_rotation_rad = 0.34906585;
};

/// How to read a CAD file named by the job.
struct CadImport {
  std::string units;     ///< "" = as the file says; mm | inch | m
  double height_mm = 0;  ///< needed for DXF; 0 = as the file says
  double edge_radius_mm = 0;
  std::string drawn;  ///< DXF with round edges: which line is drawn, flat | silhouette; "" = found out
};

struct JobOrder {
  std::string name;
  std::string workpiece_file;    ///< YAML, STEP or DXF beside the job
  std::string revision;          ///< "" or "sha256:<hex>" of the workpiece file
  std::optional<Pose2> planned;  ///< absent: centred in the working envelope
  bool guidance = true;
  plan::Inspection inspection;
  Acceptance acceptance;
  CadImport cad;
  bool execute_weld = true;
  int number = 0;    ///< PLC job number, 0 = none
  int priority = 5;  ///< 0 to 9; of waiting jobs the highest comes first, then the oldest
};

}  // namespace weldcell::job
