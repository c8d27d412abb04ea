// Where the beam travels: zigzag per member, spiral over the whole, and both as joint motion at scanning
// stand-off. Pure.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "weldcell/plan/motion_plan.hpp"
#include "weldcell/workpiece/outline_template.hpp"
#include "weldcell/workpiece/workpiece.hpp"

namespace weldcell::plan {

/// Adaptive: a sparse spiral first, then a zigzag where the part was found; beam_paths() gives its spiral.
enum class Pattern : std::uint8_t { Zigzag, Spiral, Adaptive };

struct Inspection {
  Pattern pattern = Pattern::Zigzag;
  double span_mm = 80;   ///< zigzag: length of the measured part of a pass, centred on the member's axis
  double pitch_mm = 40;  ///< zigzag: distance between passes; spiral: distance between turns
  double speed_mm_s = 200;
  double margin_mm = 15;  ///< spiral: how far beyond the planned outline the part may lie
  double margin_rad = 0.35;
  int passes_per_member = 0;  ///< zigzag: 0 = as the pitch says; else that many, even for both directions
};

/// One measured line or curve of the beam's foot on the plane of the part's top, Base mm, in order of travel.
struct BeamPath {
  std::string name;
  std::vector<Vec2> points;  ///< two for a line, many for a spiral
  /// Direction in Base towards which the laser's receiver looks; plan_scan() may turn it by half a turn.
  double receiver_angle_rad = 0;
};

/// Zigzag across each member's axis (alternating direction), or one elliptic spiral over the outline; frame
/// Base.
std::vector<BeamPath> beam_paths(const workpiece::Workpiece& workpiece, const Pose2& pose,
                                 const Inspection& inspection, Pattern pattern);

/// Joint motion that follows the beam paths in order, at inspection speed inside them and jerk-limited
/// between them, starting at rest at the first path. `near` chooses the arm's branch. Errors:
/// "plan.unreachable" naming path and point, "plan.empty", "plan.too_long", and everything that preflight()
/// refuses. A path that is too fast for the arm is slowed, never refused. Takes 0.2..2 s of computing: not
/// for a real-time thread.
Result<MotionPlan> plan_scan(const cell::CellSetup& cell, const std::vector<BeamPath>& paths, double top_z_mm,
                             double speed_mm_s, const kinematics::Joints& near);

/// Pose of the part, centred where the arm does scan and weld best ("centred in the working envelope").
Result<Pose2> centre_in_envelope(const cell::CellSetup& cell, const workpiece::Workpiece& workpiece);

/// Joints that hold the projector over a point of the table, looking down, as near to its preferred distance
/// as the arm allows. Error "plan.unreachable".
struct GuidePose {
  kinematics::Joints joints{};
  Transform<Base, Projector> T_base_projector;
};
Result<GuidePose> guide_pose(const cell::CellSetup& cell, const Vec2& centre_mm, double heading_rad,
                             const kinematics::Joints& near);

}  // namespace weldcell::plan
