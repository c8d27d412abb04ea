// The arm: OPW lengths, joint limits and speeds, and the joints <-> tool0 maps. Pure, allocation-free after
// load.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "weldcell/geometry/transform.hpp"

namespace weldcell::kinematics {

/// Joint angles J1..J6, rad, ABB's signs and zeros.
using Joints = std::array<double, 6>;

/// Spherical-wrist arm after Brandstoetter, Angerer, Hofbaur 2014. Lengths mm, angles rad.
struct ArmModel {
  std::string name;
  double a1 = 0, a2 = 0, b = 0, c1 = 0, c2 = 0, c3 = 0, c4 = 0;
  Joints offset{};  ///< model angle = sign * joint - offset
  std::array<int, 6> sign{1, 1, 1, 1, 1, 1};
  Joints lower{}, upper{};    ///< limits
  Joints max_speed{};         ///< rad/s
  double j3_j2_coupling = 0;  ///< parallel linkage: serial J3 = J3 - coupling * J2
};

/// ABB confdata of a joint set: quadrants floor(q/90 deg) of axes 1, 4, 6 and cfx 0..7.
struct Configuration {
  int cf1 = 0, cf4 = 0, cf6 = 0, cfx = 0;
  bool operator==(const Configuration&) const = default;
};

/// The closed-form solutions of one pose, one slot a branch; limits are not regarded. Real-time safe.
struct Branches {
  static constexpr int kCount = 8;
  std::array<Joints, kCount>
      joints{};  ///< each axis but J5 in the turn that lies closest to the `near` asked for
  std::array<bool, kCount> valid{};  ///< false: out of reach in this branch
};

Transform<Base, Flange> forward(const ArmModel& arm, const Joints& joints);

/// d(tool0)/d(joints): rows 0..2 velocity of the flange's origin (mm per rad), rows 3..5 its angular velocity
/// (rad per rad), both in Base.
Eigen::Matrix<double, 6, 6> jacobian(const ArmModel& arm, const Joints& joints);

/// Branch of a joint set: 4 (wrist centre behind axis 1) + 2 (wrist centre behind the lower arm) + 1 (J5
/// negative). The same number as cfx of a serial arm.
int branch_of(const ArmModel& arm, const Joints& joints);

/// All branches of a pose without allocation; slot i holds the solution with branch_of() == i. Where |sin J5|
/// < 1e-7 J4 is taken from `near` (turned half a turn in the odd branches) and J6 follows.
void inverse_branches(const ArmModel& arm, const Transform<Base, Flange>& pose, const Joints& near,
                      Branches& out);

/// Every solution inside the limits shrunk by margin_rad, turns of +-360 deg of J1, J4, J6 included.
/// Near J5 = 0 J4 is taken from `near` and only J4 + J6 is determined. Sorted by distance to `near`.
std::vector<Joints> inverse(const ArmModel& arm, const Transform<Base, Flange>& pose, const Joints& near,
                            double margin_rad = 0);

/// The solution of the same branch closest to `near`, for following a path; false when none is within the
/// limits or any joint would step by more than max_step_rad. Allocation-free.
bool inverse_near(const ArmModel& arm, const Transform<Base, Flange>& pose, const Joints& near,
                  double margin_rad, double max_step_rad, Joints& out);

/// Whether every joint keeps margin_rad (may be negative) from its limits.
bool within_limits(const ArmModel& arm, const Joints& joints, double margin_rad = 0);

/// Moves each joint by whole turns to the value closest to `near` inside the limits shrunk by margin_rad;
/// false when a joint has none.
bool nearest_turns(const ArmModel& arm, const Joints& near, double margin_rad, Joints& joints);

Configuration configuration(const ArmModel& arm, const Joints& joints);

/// Distance to trouble, 1 = best, 0 = at a limit or singularity: min over joint limit margin / half range,
/// |sin J5|, and the elbow's and shoulder's clearance. Negative outside the limits.
double dexterity(const ArmModel& arm, const Joints& joints);

}  // namespace weldcell::kinematics
