// A flat weldment as the drawing has it: members, fixtures and welds in frame Part, millimetres. Pure.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "weldcell/base/result.hpp"
#include "weldcell/geometry/plane.hpp"

namespace weldcell::workpiece {

/// One straight tubular section. The outline is its silhouette seen from above.
struct Member {
  std::string name;
  std::string tag;            ///< what the projector writes
  Polygon outline;            ///< frame Part, mm; counter-clockwise after validated()
  double edge_radius_mm = 0;  ///< round top edges along the member's long sides; 0 = sharp
};

/// A cylindrical magnet that holds a member along its outer boundary.
struct Fixture {
  double x_mm = 0;
  double y_mm = 0;
  double diameter_mm = 40;
  std::string member;
};

/// One piece of a seam: straight to `to`, or an arc through `via`. Frame Part, mm, z up from the table.
struct SeamPiece {
  bool arc = false;
  Eigen::Vector3d via = Eigen::Vector3d::Zero();
  Eigen::Vector3d to = Eigen::Vector3d::Zero();
};

struct Weld {
  std::string name;
  std::vector<std::string> joins;  ///< names of the members that it joins
  Eigen::Vector3d start = Eigen::Vector3d::Zero();
  std::vector<SeamPiece> pieces;
  double tolerance_mm = 0.6;  ///< lateral, at every point of the path
  double work_angle_rad =
      0;  ///< torch tilt from the table's normal across the seam, positive to the left of travel
  double travel_angle_rad = 0;  ///< torch tilt along the seam, positive = pushing
};

struct Workpiece {
  std::string name;
  double height_mm = 0;  ///< top surface above the table
  std::vector<Member> members;
  std::vector<Fixture> fixtures;  ///< empty: computed by guidance
  std::vector<Weld> welds;
};

/// Checks names, outlines (>= 3 distinct vertices, simple, area > 1 mm2), height > 0, welds that join known
/// members; turns outlines counter-clockwise. Error codes "workpiece.*".
Result<Workpiece> validated(Workpiece workpiece);

/// Points of the seam at most step_mm apart, first and last exact.
std::vector<Eigen::Vector3d> sample_path(const Weld& weld, double step_mm);

}  // namespace weldcell::workpiece
