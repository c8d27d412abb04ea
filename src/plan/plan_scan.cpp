#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "beam_arm.hpp"
#include "beam_curve.hpp"
#include "receiver_choice.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/plan/scan_plan.hpp"

namespace weldcell::plan {

namespace {

/// What planning leaves of the limits for the joints between pieces and for the sampling of the whole.
constexpr double kReserve = 0.96;
/// Half window over which the speed on a curve may change, in seconds of travel.
constexpr double kEase_s = 0.25;
/// A scan that takes longer is a slip in the job's pitch or speed, and its samples would not fit the daemon's
/// memory.
constexpr double kLongestScan_s = 1200;

Error unreachable(const std::string& path, const Eigen::Vector3d& place) {
  return {"plan.unreachable", path,
          fmt::format("the arm cannot hold the beam over ({:.1f}, {:.1f}) mm", place.x(), place.y()),
          "place the part nearer to the centre of the working envelope"};
}

/// Speed limits that the curve's bend sets by the cell's limits for the beam's foot.
std::vector<double> caps_of(const cell::CellSetup& cell, const Curve& curve, double speed_mm_s) {
  const double step = std::clamp(speed_mm_s * period_of(cell), 0.2, 2.0);
  const auto count = static_cast<std::size_t>(std::ceil(curve.length_mm() / step)) + 1;
  std::vector<double> caps(std::max<std::size_t>(2, count), speed_mm_s);
  for (std::size_t i = 0; i < caps.size(); ++i) {
    const double at = curve.length_mm() * static_cast<double>(i) / static_cast<double>(caps.size() - 1);
    const double bend = std::max(1e-12, curve.at(at).bend.norm());
    caps[i] = std::min({caps[i], kReserve * std::sqrt(cell.limits.line_acceleration_mm_s2 / bend),
                        kReserve * std::cbrt(cell.limits.line_jerk_mm_s3 / (bend * bend))});
  }
  return caps;
}

struct Piece {
  std::optional<MeasuredPath> path;
  std::optional<Blend> blend;
  double from_s = 0;
  std::string name;  ///< of the pass; empty for what lies between

  double duration_s() const { return path ? path->duration_s() : blend->duration_s(); }
  BeamState at(double t) const { return path ? path->at(t) : blend->at(t); }
};

/// Plans piece by piece and keeps the joints at the end of the last one, so that the branch and the turns are
/// continuous.
class ScanPlanner {
 public:
  ScanPlanner(const cell::CellSetup& cell, const AxisLimits& limits, double top_z_mm, double speed_mm_s)
      : cell_(cell), arm_(cell, limits, top_z_mm), speed_mm_s_(speed_mm_s) {}

  Result<MotionPlan> plan(const std::vector<BeamPath>& paths, const kinematics::Joints& near);

 private:
  Result<MeasuredPath> measured(const BeamPath& path, double receiver_rad,
                                const kinematics::Joints& at_start) const;
  Status blend_to(const BeamState& from, const BeamState& to, const std::string& name);
  std::optional<Blend> quickest(const BeamState& from, const BeamState& to, const kinematics::Joints& start,
                                Eigen::Vector3d& lost) const;
  bool carries(const Blend& blend, const kinematics::Joints& start, Eigen::Vector3d& lost) const;
  double ramp_s(const BeamState& moving) const;
  BeamState rest_before(const BeamState& moving, double ramp_s) const;
  BeamState rest_after(const BeamState& moving, double ramp_s) const;
  bool append(Piece piece);
  Result<MotionPlan> sampled(double stretch) const;

  const cell::CellSetup& cell_;
  BeamArm arm_;
  double speed_mm_s_;
  kinematics::Joints first_{}, last_{};
  std::vector<Piece> pieces_;
};

/// The path at the asked speed, slowed where the arm or the bend demands it.
Result<MeasuredPath> ScanPlanner::measured(const BeamPath& path, double receiver_rad,
                                           const kinematics::Joints& at_start) const {
  const Curve curve(path.points);
  std::vector<double> caps = caps_of(cell_, curve, speed_mm_s_);
  const bool line = path.points.size() == 2;
  constexpr int kRounds = 40;
  for (int round = 0; round < kRounds; ++round) {
    MeasuredPath motion(curve, SpeedProfile(curve.length_mm(), caps, kEase_s * speed_mm_s_), receiver_rad);
    Eigen::Vector3d lost;
    const std::optional<Sampled> samples = sample_motion(arm_, motion, at_start, lost);
    if (!samples) return unreachable(path.name, lost);
    if (samples->worst_hurry <= kReserve) return motion;
    if (line) {
      for (double& cap : caps) cap *= 0.98 * kReserve / samples->worst_hurry;
      continue;
    }
    for (std::size_t k = 0; k < samples->hurry.size(); ++k) {
      if (samples->hurry[k] <= kReserve) continue;
      const double s = motion.length_at(period_of(cell_) * static_cast<double>(k));
      const double at = s / curve.length_mm() * static_cast<double>(caps.size() - 1);
      const double now = motion.speed_at(period_of(cell_) * static_cast<double>(k));
      const auto i = static_cast<std::size_t>(at);
      for (std::size_t n = i; n <= std::min(i + 1, caps.size() - 1); ++n) {
        caps[n] = std::min(caps[n], 0.98 * now * kReserve / samples->hurry[k]);
      }
    }
  }
  return Error{"plan.speed", path.name, "the arm cannot follow this path at any useful speed",
               "place the part elsewhere"};
}

/// Time in which the beam gets from rest to its speed along a line, by the cell's limits for the beam's foot.
double ScanPlanner::ramp_s(const BeamState& moving) const {
  const double v = moving.rate.head<2>().norm();
  return 1.05 * std::max(1.5 * v / cell_.limits.line_acceleration_mm_s2,
                         std::sqrt(6 * v / cell_.limits.line_jerk_mm_s3));
}

/// Where to stand so that the blend into the moving state has no detour.
BeamState ScanPlanner::rest_before(const BeamState& moving, double ramp_s) const {
  BeamState rest;
  rest.place = moving.place - ramp_s / 2 * moving.rate + ramp_s * ramp_s / 12 * moving.acceleration;
  return rest;
}

BeamState ScanPlanner::rest_after(const BeamState& moving, double ramp_s) const {
  BeamState rest;
  rest.place = moving.place + ramp_s / 2 * moving.rate + ramp_s * ramp_s / 12 * moving.acceleration;
  return rest;
}

bool ScanPlanner::carries(const Blend& blend, const kinematics::Joints& start, Eigen::Vector3d& lost) const {
  constexpr int kChecks = 60;
  for (int i = 0; i <= kChecks; ++i) {
    const double t = blend.duration_s() * i / kChecks;
    if (blend.at(t).acceleration.head<2>().norm() > cell_.limits.line_acceleration_mm_s2 * 1.001)
      return false;
    if (blend.jerk_at(t).head<2>().norm() > cell_.limits.line_jerk_mm_s3 * 1.001) return false;
  }
  const std::optional<Sampled> samples = sample_motion(arm_, blend, start, lost);
  return samples && samples->worst_hurry <= kReserve;
}

/// The shortest time, within 2 %, that the limits of beam and joints allow.
std::optional<Blend> ScanPlanner::quickest(const BeamState& from, const BeamState& to,
                                           const kinematics::Joints& start, Eigen::Vector3d& lost) const {
  constexpr double kLongest_s = 12;
  double too_short = 0.02, enough = 0.1;
  while (!carries(Blend(from, to, enough), start, lost)) {
    too_short = enough;
    enough *= 1.25;
    if (enough > kLongest_s) return std::nullopt;
  }
  while (enough > 1.02 * too_short) {
    const double middle = std::sqrt(enough * too_short);
    (carries(Blend(from, to, middle), start, lost) ? enough : too_short) = middle;
  }
  return Blend(from, to, enough);
}

bool ScanPlanner::append(Piece piece) {
  Eigen::Vector3d lost;
  const std::optional<Sampled> samples = sample_motion(arm_, piece, last_, lost);
  if (!samples) return false;
  piece.from_s = pieces_.empty() ? 0 : pieces_.back().from_s + pieces_.back().duration_s();
  last_ = samples->q.back();
  pieces_.push_back(std::move(piece));
  return true;
}

/// One sweep from path to path; where the sweep would leave the arm's reach, a stop on either side of a
/// straight way.
Status ScanPlanner::blend_to(const BeamState& from, const BeamState& to, const std::string& name) {
  Eigen::Vector3d lost = to.place;
  std::vector<BeamState> stops{from, to};
  if (const std::optional<Blend> direct = quickest(from, to, last_, lost)) {
    if (append({std::nullopt, direct, 0, ""})) return Done{};
  }
  stops = {from, rest_after(from, ramp_s(from)), rest_before(to, ramp_s(to)), to};
  for (std::size_t i = 0; i + 1 < stops.size(); ++i) {
    const std::optional<Blend> part = quickest(stops[i], stops[i + 1], last_, lost);
    if (!part || !append({std::nullopt, part, 0, ""})) return unreachable(name, lost);
  }
  return Done{};
}

Result<MotionPlan> ScanPlanner::plan(const std::vector<BeamPath>& paths, const kinematics::Joints& near) {
  const Result<ReceiverChoice> choice = choose_receiver_angles(arm_, paths, near);
  if (!choice) return choice.error();
  kinematics::Joints at_start = choice->at_first;
  BeamState before;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const Eigen::Vector3d entry(paths[i].points.front().x(), paths[i].points.front().y(),
                                choice->angles_rad[i]);
    if (i > 0 && !arm_.reach(before.place, last_, entry, at_start)) return unreachable(paths[i].name, entry);
    Result<MeasuredPath> path = measured(paths[i], choice->angles_rad[i], at_start);
    if (!path) return path.error();
    const BeamState enter = path->at(0);
    if (i == 0) {
      before = rest_before(enter, ramp_s(enter));
      if (!arm_.reach(enter.place, at_start, before.place, last_))
        return unreachable(paths[i].name, before.place);
      first_ = last_;
    }
    const Status led = blend_to(before, enter, paths[i].name);
    if (!led) return led.error();
    before = path->at(path->duration_s());
    if (!append({std::move(path).value(), std::nullopt, 0, paths[i].name}))
      return unreachable(paths[i].name, entry);
  }
  const Status ended = blend_to(before, rest_after(before, ramp_s(before)), paths.back().name);
  if (!ended) return ended.error();

  // Pieces meet in acceleration but not in jerk: where a sample straddles two of them the whole is slowed a
  // little.
  Result<MotionPlan> plan = sampled(1);
  for (double stretch = 1.01; plan.ok() && stretch < 1.3; stretch *= 1.01) {
    const Status checked = preflight(cell_, *plan);
    if (checked) return plan;
    if (checked.error().code == "plan.limit" || checked.error().code == "plan.singularity")
      return checked.error();
    plan = sampled(stretch);
  }
  if (!plan) return plan;
  const Status checked = preflight(cell_, *plan);
  if (!checked) return checked.error();
  return plan;
}

/// All pieces on the controller's cycle, `stretch` times slower than planned.
Result<MotionPlan> ScanPlanner::sampled(double stretch) const {
  MotionPlan plan;
  plan.period_s = period_of(cell_);
  const double end_s = pieces_.back().from_s + pieces_.back().duration_s();
  const auto count = static_cast<std::size_t>(std::ceil(end_s * stretch / plan.period_s)) + 1;
  plan.samples.reserve(count);
  kinematics::Joints near = first_;
  std::size_t piece = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double t = std::min(end_s, plan.period_s * static_cast<double>(k) / stretch);
    while (piece + 1 < pieces_.size() && t >= pieces_[piece + 1].from_s) ++piece;
    const BeamState state = pieces_[piece].at(t - pieces_[piece].from_s);
    MotionSample sample;
    if (!arm_.joints(state.place, near, kLargestStep_rad, sample.q)) {
      return unreachable(pieces_[piece].name, state.place);
    }
    near = sample.q;
    sample.qd = arm_.speeds(sample.q, state);
    for (double& v : sample.qd) v /= stretch;
    plan.samples.push_back(sample);
  }
  plan.samples.front().qd = {}, plan.samples.back().qd = {};
  for (const Piece& p : pieces_) {
    if (!p.name.empty()) {
      plan.passes.push_back({p.name, p.from_s * stretch, (p.from_s + p.duration_s()) * stretch});
    }
  }
  return plan;
}

}  // namespace

Result<MotionPlan> plan_scan(const cell::CellSetup& cell, const std::vector<BeamPath>& paths, double top_z_mm,
                             double speed_mm_s, const kinematics::Joints& near) {
  const Result<AxisLimits> limits = axis_limits(cell);
  if (!limits) return limits.error();
  if (paths.empty())
    return Error{"plan.empty", "", "there is nothing to scan", "check the workpiece's members"};
  for (const BeamPath& path : paths) {
    if (path.points.size() < 2) return Error{"plan.empty", path.name, "a beam path needs two points", ""};
  }
  if (!(speed_mm_s > 0))
    return Error{"plan.speed", "", "the scanning speed is not positive", "state speed_mm_s"};
  double length_mm = 0;
  for (const BeamPath& path : paths) {
    for (std::size_t i = 1; i < path.points.size(); ++i)
      length_mm += (path.points[i] - path.points[i - 1]).norm();
  }
  if (!(length_mm / speed_mm_s <= kLongestScan_s)) {
    return Error{"plan.too_long", "",
                 fmt::format("{:.0f} mm of path at {} mm/s take more than {:.0f} s", length_mm, speed_mm_s,
                             kLongestScan_s),
                 "widen pitch_mm or raise speed_mm_s"};
  }
  return ScanPlanner(cell, *limits, top_z_mm, speed_mm_s).plan(paths, near);
}

}  // namespace weldcell::plan
