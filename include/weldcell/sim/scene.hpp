// A scene: what really stands on the table, how the devices really behave, seed and faults. Read from a YAML
// file; its truth is written to a file that the daemon never sees.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "weldcell/base/time.hpp"
#include "weldcell/files/cell_file.hpp"
#include "weldcell/files/fault.hpp"
#include "weldcell/geometry/plane.hpp"
#include "weldcell/sim/laser_truth.hpp"
#include "weldcell/sim/rws_load.hpp"
#include "weldcell/workpiece/workpiece.hpp"

namespace weldcell::sim {

struct ControllerTruth {
  ClockTruth clock{28397.2, -15};
  double cycle_ms = 4.0;
  double position_gain = 20;  ///< k, 1/s
  double low_pass_hz = 100;
  double dead_time_ms = 16;
  double feedback_latency_ms = 0;  ///< feedBack.time minus true instant of the posture
  std::string user = "Default User", password = "robotics";
  bool auto_mode = true;
  int rws_generation = 0;          ///< 1 or 2; 0: what the cell file expects, 1 when it leaves it open
  bool rws_hal = true;             ///< false: early RobotWare 7 that answers HAL with 406
  double rws_requests_per_s = 20;  ///< more within a second are answered 503; 0: no limit
  int robotware = 0;               ///< shape of EGM frames: 607, 610, 700, 706, 716; 0: by rws_generation
  int external_axes = 0;           ///< values that ride in externalJoints of EGM frames
  bool egm_seqno_restarts = true;  ///< at EGMSetupUC; false: the count goes on
  bool rapid_state_lost = false;   ///< EGM frames say RAPID UNDEFINED after a restart, as some controllers do
  bool remote_start = true;        ///< the user has the grant to start programs in automatic mode
  std::vector<std::string> modules;  ///< texts of the RAPID modules that are loaded at start
};

struct MemberTruth {
  double dx_mm = 0, dy_mm = 0, dtheta_rad = 0;  ///< against the part's pose
  bool missing = false;
};

/// How far members may lie from the drawing; drawn from the seed.
struct MemberSpread {
  double shift_mm = 0;   ///< 1 sigma, each direction
  double angle_rad = 0;  ///< 1 sigma
};

/// How the table really stands against where the cell's configuration puts it: lifted, and turned about the
/// middle of the planned part's top (roll about Base x after pitch about Base y). All that lies on it goes
/// with it.
struct TableTruth {
  double lift_mm = 0, roll_rad = 0, pitch_rad = 0;
};

struct TimedFault {
  /// What `at_s` counts from: the simulator's start, the first guided motion, the first arc.
  enum class After : std::uint8_t { Start, Scan, Weld };
  std::string kind;  ///< as Controller::inject() and LaserDevice::inject() know them
  After after = After::Start;
  double at_s = 0;
  double duration_s = 0;  ///< 0: for good
};

struct Scene {
  std::string name;
  std::uint64_t seed = 1;
  files::CellConfig cell;            ///< endpoints and true geometry of the same cell
  workpiece::Workpiece workpiece;    ///< real shape
  Pose2 planned;                     ///< where it was meant to lie; truth = planned moved by the placement
  Pose2 truth;                       ///< Part in Base; on a tilted table to second order in the tilt
  std::vector<MemberTruth> members;  ///< one a member
  TableTruth table;
  LaserTruth laser;
  ControllerTruth controller;
  std::vector<TimedFault> faults;
  double plc_confirm_after_s = 0.3;  ///< the simulated worker's pace
};

/// Maps where things would be on a level table at the configured height to where they are, both in Base.
Eigen::Isometry3d from_level(const Scene& scene);

/// Placement drawn from a seed: uniform within +-xy_mm and +-theta_rad about the centroid of `planned`.
Pose2 placed(const workpiece::Workpiece& workpiece, const Pose2& planned, double xy_mm, double theta_rad,
             std::uint64_t seed);
/// Members' deviations drawn from a seed, normal with the given spread.
std::vector<MemberTruth> deviated(const workpiece::Workpiece& workpiece, const MemberSpread& spread,
                                  std::uint64_t seed);

/// Reads a scene file; `seed` overrides the file's when given (nonzero).
std::variant<Scene, files::Faults> read_scene(const std::string& path, const files::CellConfig& cell,
                                              std::uint64_t seed);

/// "laser_drop@scan+5:2" = kind, when (seconds after start, or after scan or weld began), how long. Error
/// "scene.fault".
Result<TimedFault> parse_fault(const std::string& text);

/// A stretch that the torch welded: TCP positions in Base while the arc burned.
struct WeldTrace {
  std::string seam;
  std::vector<Eigen::Vector3d> tcp_mm;
};

/// A stretch in which the arm moved.
struct MotionSpan {
  double begin_s = 0, end_s = 0;
};

/// A seam as it really lies: points of its line in Base.
struct TrueSeam {
  std::string name;
  std::vector<Eigen::Vector3d> line_mm;
};
std::vector<TrueSeam> true_seams(const Scene& scene);

/// How far the torch went from the true seam that it welded.
struct WeldedSeam {
  std::string seam;             ///< name of the true seam; the trace's own when the scene has no welds
  double lateral_error_mm = 0;  ///< largest distance across the seam, in plan
  double height_error_mm = 0;   ///< largest distance over or under it
};
std::vector<WeldedSeam> welded_seams(const Scene& scene, const std::vector<WeldTrace>& traces);

/// truth.json: pose, members, seams' true lines, latency, clocks; with traces also what was welded and how
/// far off; when the arm moved, in seconds of the caller's clock; how many requests came (null: none could).
std::string truth_json(const Scene& scene, const std::vector<WeldTrace>& traces = {},
                       const std::vector<MotionSpan>& motions = {}, const RwsLoad* load = nullptr);

}  // namespace weldcell::sim
