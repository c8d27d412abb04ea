#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "poses.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/plan/scan_plan.hpp"

namespace weldcell::plan {

namespace {

constexpr double kNearest_mm = 450;
constexpr double kSteepest_rad = 15 * kPi / 180;
/// A guide pose is held at rest; it only has to be clear of the limits.
constexpr double kEnough = 0.03;

/// The optical axis through `centre`, leaning by tilt towards the azimuth.
Transform<Base, Projector> looking_at(const Eigen::Vector3d& centre, double distance_mm, double tilt_rad,
                                      double azimuth_rad, double heading_rad) {
  const Eigen::Vector3d away(std::sin(tilt_rad) * std::cos(azimuth_rad),
                             std::sin(tilt_rad) * std::sin(azimuth_rad), std::cos(tilt_rad));
  Transform<Base, Projector> out;
  out.iso.linear() = tool_rotation(-away, heading_rad);
  out.iso.translation() = centre + distance_mm * away;
  return out;
}

/// The solution with the least way from `near` among those with room enough, same branch first.
bool holds(const cell::CellSetup& cell, const Transform<Base, Projector>& pose,
           const kinematics::Joints& near, kinematics::Joints& out) {
  const Transform<Base, Flange> flange = pose * cell.projector.T_flange_projector.inverse();
  const int branch = kinematics::branch_of(cell.arm, near);
  const std::vector<kinematics::Joints> all =
      kinematics::inverse(cell.arm, flange, near, cell.limits.limit_margin_rad);
  for (const bool same : {true, false}) {
    for (const kinematics::Joints& q : all) {
      if ((kinematics::branch_of(cell.arm, q) == branch) != same) continue;
      if (std::abs(std::sin(q[4])) < cell.limits.min_sin_j5 || kinematics::dexterity(cell.arm, q) < kEnough)
        continue;
      out = q;
      return true;
    }
  }
  return false;
}

}  // namespace

Result<GuidePose> guide_pose(const cell::CellSetup& cell, const Vec2& centre_mm, double heading_rad,
                             const kinematics::Joints& near) {
  const Eigen::Vector3d centre(centre_mm.x(), centre_mm.y(), cell.table.z_mm);
  const double farthest = std::max(kNearest_mm, cell.projector.distance_mm);
  // First the picture the right way round, then upside down (which the drawing makes good), then across.
  for (const double turn : {0.0, kPi, kPi / 2, -kPi / 2}) {
    for (double tilt = 0; tilt <= kSteepest_rad + 1e-9; tilt += kSteepest_rad / 3) {
      for (double distance = farthest; distance > kNearest_mm - 1e-9; distance -= 50) {
        for (int a = 0; a < (tilt > 0 ? 8 : 1); ++a) {
          const auto pose = looking_at(centre, distance, tilt, kPi / 4 * a, heading_rad + turn);
          GuidePose out{{}, pose};
          if (holds(cell, pose, near, out.joints)) return out;
        }
      }
    }
  }
  return Error{"plan.unreachable", "projector",
               fmt::format("the arm cannot hold the projector over ({:.0f}, {:.0f}) mm at {:.0f}..{:.0f} mm",
                           centre_mm.x(), centre_mm.y(), kNearest_mm, farthest),
               "place the part nearer to the centre of the working envelope"};
}

}  // namespace weldcell::plan
