// Edge points + outline template -> pose of the part, its covariance, its members and whether to trust it.
// Pure.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "weldcell/geometry/edge_point.hpp"
#include "weldcell/workpiece/outline_template.hpp"

namespace weldcell::localize {

enum class Method : std::uint8_t { Robust, Paper };
enum class Verdict : std::uint8_t { Weld, Rescan, Reject };
const char* to_string(Verdict);

struct LocalizeOptions {
  Method method = Method::Robust;
  Pose2 planned;              ///< Part in Base, where it should lie
  double range_mm = 50;       ///< how far the centroid may be from planned
  double range_rad = 0.349;   ///< and how far turned; >= pi searches the full circle
  double max_offset_mm = 50;  ///< acceptance: a found pose farther off is rejected
  double max_rotation_rad = 0.349;
  double default_sigma_mm = 0.3;    ///< for edge points without sigma
  double latency_sigma_s = 0.0005;  ///< prior of the residual latency (mean 0); 0 fixes it
  double inset_sigma_mm = 0.5;      ///< prior of the shift of seen edges inwards (round corners); 0 fixes it
  double member_shift_sigma_mm = 0.5;  ///< drawing's tolerance of a member's place, prior of the member term
  double member_angle_sigma_rad = 0.0022;
  double max_member_shift_mm = 3;  ///< acceptance: a member farther off than this is another revision
  /// Each member's sides, place along itself, direction and closed joints must be shown to be nearer to the
  /// drawing than this, else the verdict is rescan; 0: not asked, else 6..100. Needs a path.
  double prove_shift_mm = 20;
  bool prove_free_ends = false;    ///< also that no end in the open is longer or shorter by as much
  double max_mean_error_mm = 2.5;  ///< the paper's rule, used by Method::Paper
  bool full_reject_checks = true;  ///< negative evidence and second modes
};

struct MemberPose {
  std::string name;
  double dx_mm = 0, dy_mm = 0;  ///< shift of the member's centroid against the part's pose, Base axes
  double dtheta_rad = 0;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of (dx, dy, dtheta), mm and rad
  double sigma_mm = 0;                                   ///< largest 1 sigma of the shift
  int points = 0;
};

/// One straight pass of the beam that would show what this scan did not look at.
struct ScanLine {
  std::string member;
  Vec2 from = Vec2::Zero(), to = Vec2::Zero();  ///< frame Part, mm
};

struct Alternative {
  Pose2 pose;
  double mean_error_mm = 0;
};

/// The outcome with its quality. All lengths mm, angles rad; covariances in (x, y, theta) about the
/// template's centroid.
struct Localization {
  Verdict verdict = Verdict::Reject;
  /// Stable code. weld: "ok". rescan: "too_few_points", "one_line" (all points on one straight line),
  /// "not_enough" (a direction of the pose stays open), "ambiguous", "not_looked_at" (a member could be other
  /// than drawn without the scan having shown it; `rescan` says where to look). reject: "mirrored",
  /// "out_of_range", "clutter", "no_fit", "bad_points", "bad_path", "bad_options" (what is no number or no
  /// sensible one), "mean_error" (Method::Paper). rescan where the evidence is weak, else reject:
  /// "wrong_revision", "member_missing".
  std::string cause;
  std::string reason;  ///< in a welder's words, with one action
  Pose2 pose;          ///< Part in Base
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  Vec2 centroid_base = Vec2::Zero();  ///< template's centroid in Base, where the covariance holds
  double mean_error_mm = 0;           ///< mean distance of all points to the outline (the paper's figure)
  int points = 0, inliers = 0;
  std::vector<int>
      edge_of_point;  ///< index into the template's edges, -1 = outlier or off the path; one per point
  std::vector<double> residual_mm;  ///< signed distance to that edge along its outward normal; one per point
  std::optional<double> latency_s;  ///< residual latency found, when estimated
  double inset_mm = 0;
  std::vector<Alternative> alternatives;
  std::vector<MemberPose> members;
  std::vector<ScanLine> rescan;  ///< what settles "not_looked_at", or "wrong_revision" in doubt: all of these
  int iterations = 0;
};

/// Never throws on data: NaN, empty and degenerate sets end as Reject or Rescan with a cause. Deterministic.
Localization localize(const workpiece::OutlineTemplate& outline, std::span<const EdgePoint> edges,
                      std::span<const PathPiece> path, const LocalizeOptions& options);

/// Offset of found against planned (the paper's M): turn about, and shift of, the template's centroid.
struct Offset {
  double dx_mm = 0, dy_mm = 0, dtheta_rad = 0;
};
Offset offset_from_planned(const workpiece::OutlineTemplate& outline, const Pose2& planned,
                           const Pose2& found);

}  // namespace weldcell::localize
