// Weld certificates: the bound of each weld's lateral error against its tolerance, after localization. Pure.
#pragma once

#include <string>
#include <vector>

#include "weldcell/localize/localize.hpp"
#include "weldcell/workpiece/workpiece.hpp"

namespace weldcell::weld {

struct WeldCertificate {
  std::string name;
  double bound_mm = 0;        ///< 95 % bound of the lateral error at the worst point of the weld
  double tolerance_mm = 0;
  double gap_mm = 0;          ///< opening of the joint against the drawing, from the members' own poses; + = open
  localize::Verdict verdict = localize::Verdict::Reject;
  std::string reason;
  std::vector<Eigen::Vector3d> path;  ///< re-planned seam, Base mm, at most 2 mm apart
};

struct CertifyOptions {
  double robot_sigma_mm = 0.05;    ///< arm's own path error, added to the bound
  double max_gap_mm = 1.0;
  double table_z_mm = 0;
};

/// One certificate a weld. A weld follows the members that it joins: its path moves with the part and with the mean of
/// their own poses, and its bound comes from part and member covariances.
std::vector<WeldCertificate> certify(const workpiece::Workpiece& workpiece, const localize::Localization& found,
                                     const CertifyOptions& options);

/// The job's verdict: weld only if the pose and every weld say so; otherwise the gravest, with its reason.
struct JobVerdict {
  localize::Verdict verdict = localize::Verdict::Reject;
  std::string reason;
};
JobVerdict decide(const localize::Localization& found, const std::vector<WeldCertificate>& certificates);

}  // namespace weldcell::weld
