// The arm behind the beam: joints, joint speeds and their load for states of the beam's foot on the scanned
// plane. Pure.
#pragma once

#include <optional>

#include "axis_limits.hpp"
#include "beam_curve.hpp"

namespace weldcell::plan {

class BeamArm {
 public:
  BeamArm(const cell::CellSetup& cell, const AxisLimits& limits, double top_z_mm);

  /// Flange pose with the beam straight down on (x, y), receiver towards the angle, at scanning stand-off.
  Transform<Base, Flange> flange(const Eigen::Vector3d& place) const;
  /// Joints in the branch of `near`, in the turn closest to it; false when out of reach or limits, or more
  /// than max_step_rad away.
  bool joints(const Eigen::Vector3d& place, const kinematics::Joints& near, double max_step_rad,
              kinematics::Joints& out) const;
  /// Follows the straight way between two places of the beam; false when it leaves the arm's reach on the
  /// way.
  bool reach(const Eigen::Vector3d& from, const kinematics::Joints& at_from, const Eigen::Vector3d& to,
             kinematics::Joints& at_to) const;
  kinematics::Joints speeds(const kinematics::Joints& q, const BeamState& state) const;

  const cell::CellSetup& cell() const { return cell_; }
  const AxisLimits& limits() const { return limits_; }

 private:
  const cell::CellSetup& cell_;
  AxisLimits limits_;
  double beam_z_mm_;
  Transform<Laser, Flange> T_laser_flange_;
};

/// Joints and speeds of a stretch of motion at the cell's period, and which share of the limits it uses at
/// each sample as a factor of time: 1.1 = has to take 1.1 times as long.
struct Sampled {
  std::vector<kinematics::Joints> q, qd;
  std::vector<double> hurry;
  double worst_hurry = 0;
};

/// nullopt when the arm cannot follow; `lost` then names the place.
template <typename Motion>
std::optional<Sampled> sample_motion(const BeamArm& arm, const Motion& motion,
                                     const kinematics::Joints& start, Eigen::Vector3d& lost);

/// The factor of time that brings three neighbouring joint speeds within the limits.
double hurry_of(const AxisLimits& limits, const kinematics::Joints& before, const kinematics::Joints& now,
                const kinematics::Joints& after, double period_s);

/// No scan sample steps farther than this in one cycle: 2 rad in 4 ms is no motion but a jump of the branch.
constexpr double kLargestStep_rad = 0.2;

template <typename Motion>
std::optional<Sampled> sample_motion(const BeamArm& arm, const Motion& motion,
                                     const kinematics::Joints& start, Eigen::Vector3d& lost) {
  const double period_s = period_of(arm.cell());
  const auto count = static_cast<std::size_t>(std::ceil(motion.duration_s() / period_s)) + 1;
  Sampled out;
  out.q.reserve(count), out.qd.reserve(count);
  kinematics::Joints near = start;
  for (std::size_t k = 0; k < count; ++k) {
    const BeamState state = motion.at(std::min(motion.duration_s(), period_s * static_cast<double>(k)));
    kinematics::Joints q{};
    if (!arm.joints(state.place, near, kLargestStep_rad, q)) {
      lost = state.place;
      return std::nullopt;
    }
    near = q;
    out.q.push_back(q);
    out.qd.push_back(arm.speeds(q, state));
  }
  out.hurry.assign(count, 0);
  for (std::size_t k = 1; k + 1 < count; ++k) {
    out.hurry[k] = hurry_of(arm.limits(), out.qd[k - 1], out.qd[k], out.qd[k + 1], period_s);
    out.worst_hurry = std::max(out.worst_hurry, out.hurry[k]);
  }
  return out;
}

}  // namespace weldcell::plan
