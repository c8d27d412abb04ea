// Weld certificates: the bound of each weld's lateral error against its tolerance, after localization. Pure.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "weldcell/localize/height.hpp"
#include "weldcell/localize/localize.hpp"
#include "weldcell/workpiece/workpiece.hpp"

namespace weldcell::weld {

struct WeldCertificate {
  std::string name;
  double bound_mm = 0;  ///< 95 % bound of the lateral error at the worst point of the weld
  double tolerance_mm = 0;
  double gap_mm = 0;  ///< opening of the joint against the drawing, from the members' own poses; + = open
  localize::Verdict verdict = localize::Verdict::Reject;
  std::string reason;
  std::vector<Eigen::Vector3d> path;  ///< re-planned seam, Base mm, at most 2 mm apart
  double sigma_mm = 0;                ///< 1 sigma of the lateral error at the worst point, robot included
  double gap_sigma_mm = 0;            ///< 1 sigma of gap_mm
  Eigen::Vector3d worst = Eigen::Vector3d::Zero();  ///< the point of the path with the largest bound, Base mm
  std::string weakest;  ///< what limits the bound: a member's name, "part" or "robot"
};

/// The part's upper surface as the scan saw it: seams follow it, also on a table that is not level or not
/// quite at its configured height.
struct MeasuredTop {
  Vec2 reference = Vec2::Zero();  ///< Base, mm
  localize::TiltedPlane plane;
};

struct CertifyOptions {
  double robot_sigma_mm = 0.05;  ///< arm's own path error, added to the bound
  double max_gap_mm = 1.0;
  double table_z_mm = 0;
  std::optional<MeasuredTop> top;  ///< absent: the part's top lies its height above table_z_mm everywhere
  double max_height_off_mm = 5;    ///< a measured top farther from that is not believed and nothing is welded
  double bias_mm = 0;  ///< lateral error known to be one-sided (calibration residual); added in full
  double max_member_shift_mm = 3;  ///< a member displaced by more at its weld belongs to another drawing
  double unmeasured_shift_sigma_mm = 0.5;  ///< of a joined member of which the localization says nothing
  double unmeasured_angle_sigma_rad = 0.0022;
};

/// Largest distance between neighbouring points of a certificate's path.
inline constexpr double kPathStepMm = 2.0;
/// Two-sided 95 % of a normal distribution.
inline constexpr double kSigmas95 = 1.959964;

/// One certificate a weld. A weld follows the members that it joins: its path moves with the part and with
/// the mean of their own poses, and its bound comes from part and member covariances (taken as independent,
/// which is on the safe side). A localization that is not trusted gives no weld; one that is rejected gives
/// no path either.
std::vector<WeldCertificate> certify(const workpiece::Workpiece& workpiece,
                                     const localize::Localization& found, const CertifyOptions& options);

/// Certificates of a part that lies exactly at `pose`: for checking reach before anything is measured.
std::vector<WeldCertificate> assume_exact(const workpiece::Workpiece& workpiece, const Pose2& pose,
                                          const CertifyOptions& options);

/// The job's verdict: weld only if the pose and every weld say so; otherwise the gravest, with its reason.
struct JobVerdict {
  localize::Verdict verdict = localize::Verdict::Reject;
  std::string reason;
};
JobVerdict decide(const localize::Localization& found, const std::vector<WeldCertificate>& certificates);

}  // namespace weldcell::weld
