#include "judge.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>

#include "weldcell/base/units.hpp"

namespace weldcell::bench {

using localize::Localization;
using localize::LocalizeOptions;
using localize::Verdict;

PartUnderTest part_under_test(const workpiece::Workpiece& workpiece) {
  return {workpiece, localize::Localizer(*workpiece::build_template(workpiece))};
}

double Tally::ratio() const { return std::sqrt(ratio_square / (3 * judged)); }

namespace {

/// Standard error of a mean from the sums of its terms and of their squares.
double error_of_mean(double sum, double squares, int count) {
  const double mean = sum / count;
  return std::sqrt(std::max(0.0, squares / count - mean * mean) / count);
}

}  // namespace

double Tally::ratio_error() const {
  return error_of_mean(ratio_square, ratio_fourth, judged) / 3 / (2 * ratio());
}

double Tally::nees_error() const { return error_of_mean(nees, nees_square, judged) / 3; }

double Tally::share_error(int count) const {
  // Of none or all one more trial might have been the first of its kind.
  const double share = std::clamp(1.0 * count / trials, 1.0 / (trials + 1), trials / (trials + 1.0));
  return 100 * std::sqrt(share * (1 - share) / trials);
}

double Tally::milliseconds(double quantile) const {
  std::vector<double> sorted = ms;
  std::sort(sorted.begin(), sorted.end());
  return sorted[static_cast<std::size_t>(quantile * static_cast<double>(sorted.size() - 1))];
}

LocalizeOptions options_for(const Setting& setting) {
  LocalizeOptions o;
  o.range_mm = std::max(50.0, setting.shift_mm);
  o.range_rad = setting.turn_deg > 20 ? kPi : rad(20);
  o.max_offset_mm = o.range_mm;
  o.max_rotation_rad = o.range_rad;
  return o;
}

Eigen::Vector3d error_of(const workpiece::OutlineTemplate& outline, const Pose2& truth, const Pose2& found) {
  const auto error = [&](const Pose2& pose) {
    const localize::Offset off = localize::offset_from_planned(outline, truth, pose);
    return Eigen::Vector3d(off.dx_mm, off.dy_mm, off.dtheta_rad);
  };
  Eigen::Vector3d best = error(found);
  for (const workpiece::Symmetry& s : outline.symmetries) {
    if (s.gap_mm != 0) continue;
    const Eigen::Vector3d other = error(found * s.map);
    if (std::abs(other.z()) < std::abs(best.z())) best = other;
  }
  return best;
}

bool good(const Eigen::Vector3d& error) {
  return error.head<2>().norm() <= 1 && std::abs(deg(error.z())) <= 0.2;
}

bool in_basin(const Eigen::Vector3d& error) {
  return error.head<2>().norm() <= 5 && std::abs(deg(error.z())) <= 1.5;
}

void judge(const workpiece::OutlineTemplate& outline, const Setting& setting, const EdgeSet& set,
           const Localization& found, Tally& tally, const std::string& label) {
  const Eigen::Vector3d e = error_of(outline, set.truth, found.pose);
  const bool right = good(e), near = in_basin(e), accepted = found.verdict == Verdict::Weld;
  ++tally.trials;
  tally.success += right;
  tally.basin += near;
  tally.accepted += accepted;
  tally.false_accept += accepted && !right;
  tally.false_reject += right && found.verdict == Verdict::Reject;
  tally.again += right && found.verdict == Verdict::Rescan;
  if (accepted && !right) ++tally.blunders["accepted wrong, " + label];
  if (right && !accepted && found.rescan.empty() && setting.members_missing == 0)
    ++tally.blunders["refused as " + found.cause + ", " + label];
  if (!near) {
    ++tally.blunders["missed (" + found.cause + "), " + label];
    return;
  }
  const Eigen::Vector4d limit = bound(outline, setting, set).diagonal();
  const double square = e.cwiseAbs2().cwiseQuotient(limit.head<3>()).sum();
  tally.ratio_square += square;
  tally.ratio_fourth += square * square;
  for (int i = 0; i < 3; ++i) tally.error_square[static_cast<std::size_t>(i)] += e(i) * e(i);
  const double nees = found.covariance.trace() > 0 ? e.dot(found.covariance.ldlt().solve(e)) : 0;
  tally.nees += nees;
  tally.nees_square += nees * nees;
  if (found.latency_s) tally.latency_square += std::pow(*found.latency_s - setting.latency_s, 2);
  tally.latency_limit_square += 1e-6 * limit(3);
  ++tally.judged;
}

double cpu_ms() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

Tally run_cell(const PartUnderTest& part, const Setting& setting, int trials, std::uint64_t seed,
               const Solve& solve) {
  Tally tally;
  for (int i = 0; i < trials; ++i) {
    const std::uint64_t one = seed + static_cast<std::uint64_t>(i);
    const EdgeSet set = make_set(part.outline(), setting, one);
    const double start = cpu_ms();
    const Localization found = solve(set);
    tally.ms.push_back(cpu_ms() - start);
    judge(part.outline(), setting, set, found, tally, "seed " + std::to_string(one));
  }
  return tally;
}

Solve solver_of(const PartUnderTest& part, const Setting& setting, localize::Method method) {
  LocalizeOptions options = options_for(setting);
  options.method = method;
  return
      [&part, options](const EdgeSet& set) { return part.localizer.localize(set.edges, set.path, options); };
}

}  // namespace weldcell::bench
