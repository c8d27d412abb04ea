#include <algorithm>
#include <cmath>

#include "model_angles.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::kinematics {

namespace {

constexpr double kTurn = 2 * kPi;
constexpr double kWristSingular = 1e-7;
/// Reach is closed: a pose computed by forward() at the stretched arm may lie this far outside by rounding.
constexpr double kReachSlack_mm = 1e-9;

double closest_turn(double angle, double near) { return angle + kTurn * std::round((near - angle) / kTurn); }

/// The elbow's angle (0 = stretched .. pi = folded) for a distance from shoulder to wrist centre. Half-angle
/// form: exact at both ends, where acos loses half the digits.
bool elbow_angle(double lower_mm, double upper_mm, double distance_mm, double& elbow_rad) {
  const double from_stretched = lower_mm + upper_mm - distance_mm;
  const double from_folded = distance_mm - std::abs(lower_mm - upper_mm);
  // Written so that a pose that is no number is out of reach.
  if (!(from_stretched >= -kReachSlack_mm && from_folded >= -kReachSlack_mm)) return false;
  const double far = std::max(0.0, from_stretched) * (lower_mm + upper_mm + distance_mm);
  const double close = std::max(0.0, from_folded) * (distance_mm + std::abs(lower_mm - upper_mm));
  elbow_rad = 2 * std::atan2(std::sqrt(far), std::sqrt(close));
  return true;
}

/// Wrist angles of the branch with theta5 >= 0 and of its mirror; near theta5 = 0 or pi theta4 is the one
/// asked for.
void solve_wrist(const Eigen::Matrix3d& w, double near4, double (&even)[3], double (&odd)[3]) {
  const double s5 = std::hypot(w(0, 2), w(1, 2));
  const double t5 = std::atan2(s5, w(2, 2));
  double t4 = near4, t6 = 0;
  if (s5 >= kWristSingular) {
    t4 = std::atan2(w(1, 2), w(0, 2));
    t6 = std::atan2(w(2, 1), -w(2, 0));
  } else if (w(2, 2) > 0) {
    t6 = std::atan2(w(1, 0) - w(0, 1), w(0, 0) + w(1, 1)) - t4;
  } else {
    t6 = std::atan2(w(1, 0) + w(0, 1), w(1, 1) - w(0, 0)) + t4;
  }
  even[0] = t4, even[1] = t5, even[2] = t6;
  odd[0] = t4 + kPi, odd[1] = -t5, odd[2] = t6 - kPi;
}

}  // namespace

void inverse_branches(const ArmModel& arm, const Transform<Base, Flange>& pose, const Joints& near,
                      Branches& out) {
  const UpperArm upper(arm);
  const Eigen::Matrix3d rotation = pose.iso.linear();
  const Eigen::Vector3d wrist = pose.iso.translation() - arm.c4 * rotation.col(2);
  const double flat2 = wrist.head<2>().squaredNorm() - arm.b * arm.b;
  out.valid.fill(false);
  if (!(flat2 >= 0)) return;
  const double flat = std::sqrt(flat2);
  const double bearing = std::atan2(wrist.y(), wrist.x());
  const double aside = std::atan2(arm.b, flat);
  const double up = wrist.z() - arm.c1;
  const Joints near_model = to_model(arm, near);

  for (int behind = 0; behind < 2; ++behind) {
    Joints t{};
    t[0] = behind ? bearing + aside - kPi : bearing - aside;
    const double out_from_shoulder = (behind ? -flat : flat) - arm.a1;
    double elbow = 0;
    if (!elbow_angle(arm.c2, upper.length_mm, std::hypot(out_from_shoulder, up), elbow)) continue;
    for (int under = 0; under < 2; ++under) {
      const double bend = under ? -elbow : elbow;
      t[1] = std::atan2(out_from_shoulder, up) -
             std::atan2(upper.length_mm * std::sin(bend), arm.c2 + upper.length_mm * std::cos(bend));
      t[2] = bend - upper.angle_rad;
      const Eigen::Matrix3d fore = (Eigen::AngleAxisd(t[0], Eigen::Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(t[1] + t[2], Eigen::Vector3d::UnitY()))
                                       .toRotationMatrix();
      double even[3], odd[3];
      solve_wrist(fore.transpose() * rotation, near_model[3], even, odd);
      for (int negative = 0; negative < 2; ++negative) {
        const double* hand = negative ? odd : even;
        t[3] = hand[0], t[4] = hand[1], t[5] = hand[2];
        const auto slot = static_cast<std::size_t>(4 * behind + 2 * under + negative);
        out.joints[slot] = from_model(arm, t);
        for (const std::size_t i : {0u, 1u, 2u, 3u, 5u}) {
          out.joints[slot][i] = closest_turn(out.joints[slot][i], near[i]);
        }
        out.valid[slot] = true;
      }
    }
  }
}

bool nearest_turns(const ArmModel& arm, const Joints& near, double margin_rad, Joints& joints) {
  for (std::size_t i = 0; i < 6; ++i) {
    const double low = arm.lower[i] + margin_rad, high = arm.upper[i] - margin_rad;
    double q = closest_turn(joints[i], near[i]);
    if (q < low) q += kTurn * std::ceil((low - q) / kTurn);
    if (q > high) q -= kTurn * std::ceil((q - high) / kTurn);
    if (!(q >= low && q <= high)) return false;
    joints[i] = q;
  }
  return true;
}

std::vector<Joints> inverse(const ArmModel& arm, const Transform<Base, Flange>& pose, const Joints& near,
                            double margin_rad) {
  Branches branches;
  inverse_branches(arm, pose, near, branches);
  std::vector<Joints> found;
  for (std::size_t slot = 0; slot < Branches::kCount; ++slot) {
    if (!branches.valid[slot]) continue;
    std::vector<Joints> turned{branches.joints[slot]};
    for (std::size_t i = 0; i < 6; ++i) {
      const double low = arm.lower[i] + margin_rad, high = arm.upper[i] - margin_rad;
      std::vector<Joints> next;
      for (const Joints& q : turned) {
        for (double a = q[i] + kTurn * std::ceil((low - q[i]) / kTurn); a <= high; a += kTurn) {
          next.push_back(q);
          next.back()[i] = a;
        }
      }
      turned = std::move(next);
    }
    found.insert(found.end(), turned.begin(), turned.end());
  }
  const auto distance2 = [&near](const Joints& q) {
    double sum = 0;
    for (std::size_t i = 0; i < 6; ++i) sum += (q[i] - near[i]) * (q[i] - near[i]);
    return sum;
  };
  std::stable_sort(found.begin(), found.end(),
                   [&](const Joints& a, const Joints& b) { return distance2(a) < distance2(b); });
  return found;
}

bool inverse_near(const ArmModel& arm, const Transform<Base, Flange>& pose, const Joints& near,
                  double margin_rad, double max_step_rad, Joints& out) {
  Branches branches;
  inverse_branches(arm, pose, near, branches);
  const auto slot = static_cast<std::size_t>(branch_of(arm, near));
  if (!branches.valid[slot]) return false;
  Joints q = branches.joints[slot];
  if (!nearest_turns(arm, near, margin_rad, q)) return false;
  for (std::size_t i = 0; i < 6; ++i) {
    if (!(std::abs(q[i] - near[i]) <= max_step_rad)) return false;
  }
  out = q;
  return true;
}

}  // namespace weldcell::kinematics
