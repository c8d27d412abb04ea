// Random motions by the project's planner, and a judge of their references that shares nothing with
// preflight(): it differentiates what would be sent and takes the limits from the cell itself.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <string>

#include "weldcell/base/units.hpp"
#include "weldcell/plan/scan_plan.hpp"

namespace weldcell::bench {

/// Rounding of third differences over 4 ms; a share of a limit up to 1 + this passes.
constexpr double kShareSlack = 1e-3;

/// Worst shares of the limits over the plans seen; at most 1 + kShareSlack where they are kept.
struct Shares {
  double stated_speed = 0, stated_acceleration = 0, stated_jerk = 0;  ///< of qd and its differences
  double speed = 0, acceleration = 0, jerk = 0;  ///< of first, second and third differences of q
  double range_excess_rad = -1e9;                ///< beyond the range less its margin; negative inside
  double end_speed_rad_s = 0;                    ///< stated at the first and last reference
  bool finite = true;

  void take(const Shares& s) {
    stated_speed = std::max(stated_speed, s.stated_speed);
    stated_acceleration = std::max(stated_acceleration, s.stated_acceleration);
    stated_jerk = std::max(stated_jerk, s.stated_jerk);
    speed = std::max(speed, s.speed);
    acceleration = std::max(acceleration, s.acceleration);
    jerk = std::max(jerk, s.jerk);
    range_excess_rad = std::max(range_excess_rad, s.range_excess_rad);
    end_speed_rad_s = std::max(end_speed_rad_s, s.end_speed_rad_s);
    finite = finite && s.finite;
  }
  /// Empty when every limit is kept, else the names of those that are not.
  std::string broken() const {
    std::string out;
    const auto name = [&out](bool wrong, const char* what) {
      if (wrong) out += (out.empty() ? "" : ", ") + std::string(what);
    };
    const double most = 1 + kShareSlack;
    name(!finite, "not a number");
    name(stated_speed > most, "stated speed");
    name(stated_acceleration > most, "stated acceleration");
    name(stated_jerk > most, "stated jerk");
    name(speed > most, "speed");
    name(acceleration > most, "acceleration");
    name(jerk > most, "jerk");
    name(range_excess_rad > 1e-9, "range");
    name(end_speed_rad_s > 1e-6, "rest at the ends");
    return out;
  }
};

/// The arm stands before the first and after the last reference: those differences count too.
inline Shares judge(const cell::CellSetup& cell, const plan::MotionPlan& plan) {
  Shares out;
  const auto n = static_cast<long>(plan.samples.size());
  const double h = plan.period_s;
  const auto& limits = cell.limits;
  for (std::size_t i = 0; i < 6; ++i) {
    const double v_max = cell.arm.max_speed[i] * limits.joint_speed_fraction;
    const double a_max = limits.joint_acceleration[i];
    double j_max = limits.joint_jerk[i];
    if (limits.natural_frequency_hz > 0) j_max = std::min(j_max, a_max * limits.natural_frequency_hz);
    const auto q = [&](long k) {
      return plan.samples[static_cast<std::size_t>(std::clamp(k, 0L, n - 1))].q[i];
    };
    const auto v = [&](long k) {
      return k < 0 || k >= n ? 0 : plan.samples[static_cast<std::size_t>(k)].qd[i];
    };
    const auto raise = [](double& worst, double value) { worst = std::max(worst, std::abs(value)); };
    for (long k = 0; k < n + 3; ++k) {
      out.finite = out.finite && std::isfinite(q(k)) && std::isfinite(v(k));
      raise(out.stated_speed, v(k) / v_max);
      raise(out.stated_acceleration, (v(k) - v(k - 1)) / h / a_max);
      raise(out.stated_jerk, (v(k) - 2 * v(k - 1) + v(k - 2)) / (h * h) / j_max);
      raise(out.speed, (q(k) - q(k - 1)) / h / v_max);
      raise(out.acceleration, (q(k) - 2 * q(k - 1) + q(k - 2)) / (h * h) / a_max);
      raise(out.jerk, (q(k) - 3 * q(k - 1) + 3 * q(k - 2) - q(k - 3)) / (h * h * h) / j_max);
      out.range_excess_rad =
          std::max({out.range_excess_rad, q(k) - cell.arm.upper[i] + limits.limit_margin_rad,
                    cell.arm.lower[i] + limits.limit_margin_rad - q(k)});
    }
    out.end_speed_rad_s = std::max({out.end_speed_rad_s, std::abs(v(0)), std::abs(v(n - 1))});
  }
  return out;
}

enum class Motion { PointToPoint, Line, Spiral };
constexpr std::array<const char*, 3> kMotionNames{"point to point", "line", "spiral"};

/// One random motion of the cell's arm; refused by the planner where it does not fit. The cell's home only
/// chooses the branch.
inline Result<plan::MotionPlan> random_plan(const cell::CellSetup& cell, Motion motion,
                                            std::mt19937_64& random) {
  const auto between = [&random](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  if (motion == Motion::PointToPoint) {
    kinematics::Joints from{}, to{};
    // A quarter is short, down to 1e-4 of the range.
    const double part = between(0, 1) < 0.25 ? std::pow(10, between(-4, 0)) : 1;
    for (std::size_t i = 0; i < 6; ++i) {
      const double low = cell.arm.lower[i] + cell.limits.limit_margin_rad;
      const double high = cell.arm.upper[i] - cell.limits.limit_margin_rad;
      from[i] = between(low, high);
      to[i] = from[i] + part * (between(low, high) - from[i]);
    }
    return plan::joint_move(cell, from, to);
  }
  const double reach_mm = kinematics::forward(cell.arm, {}).position_mm().x();
  const double size_mm = reach_mm * between(0.05, 0.2), heading = between(-kPi, kPi);
  const double away_mm = reach_mm * between(0.5, 1.0), bearing = between(-0.6, 0.6);
  const Vec2 centre(away_mm * std::cos(bearing), away_mm * std::sin(bearing));
  plan::BeamPath path;
  path.name = kMotionNames[static_cast<std::size_t>(motion)];
  path.receiver_angle_rad = between(-kPi, kPi);
  if (motion == Motion::Line) {
    const Vec2 half = size_mm / 2 * Vec2(std::cos(heading), std::sin(heading));
    path.points = {centre - half, centre + half};
  } else {
    const double pitch_mm = between(0.2, 0.5) * size_mm, b = pitch_mm / (2 * kPi);
    for (double turn = kPi; b * turn < size_mm / 2 + pitch_mm; turn += 1 / std::max(4.0, b * turn))
      path.points.push_back(centre + b * turn * Vec2(std::cos(turn + heading), std::sin(turn + heading)));
  }
  return plan::plan_scan(cell, {path}, cell.table.z_mm * between(0.2, 1.1), between(20, 400), cell.home);
}

struct PlanTally {
  std::array<int, 3> planned{};
  std::map<std::string, int> refused;  ///< by kind of motion and error code
  int broken = 0;
  std::string first_broken;
  Shares worst;
};

/// Tries a motion, judges what is planned.
inline void try_plan(const cell::CellSetup& cell, Motion motion, std::mt19937_64& random, PlanTally& tally) {
  const auto kind = static_cast<std::size_t>(motion);
  const auto plan = random_plan(cell, motion, random);
  if (!plan.ok()) {
    ++tally.refused[std::string(kMotionNames[kind]) + ": " + plan.error().code];
    return;
  }
  ++tally.planned[kind];
  const Shares shares = judge(cell, *plan);
  tally.worst.take(shares);
  const std::string broken = shares.broken();
  if (broken.empty()) return;
  ++tally.broken;
  if (tally.first_broken.empty())
    tally.first_broken = cell.arm.name + ", " + kMotionNames[kind] + ": " + broken;
}

}  // namespace weldcell::bench
