// One cell of the bench: many seeded scans of one weldment in one setting, and what the answers were worth.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "edge_sets.hpp"
#include "weldcell/localize/localizer.hpp"

namespace weldcell::bench {

struct PartUnderTest {
  workpiece::Workpiece workpiece;
  localize::Localizer localizer;
  const workpiece::OutlineTemplate& outline() const { return localizer.outline(); }
};
PartUnderTest part_under_test(const workpiece::Workpiece& workpiece);

/// What a method says about one set.
using Solve = std::function<localize::Localization(const EdgeSet&)>;

/// Sums over the trials of one cell.
struct Tally {
  int trials = 0, success = 0, basin = 0, accepted = 0, false_accept = 0;
  int false_reject = 0, again = 0;  ///< good poses rejected, and asked for another scan
  int judged = 0;                   ///< trials inside the basin: only these count below
  double ratio_square = 0, nees = 0;
  double latency_square = 0, latency_limit_square = 0;  ///< s2: errors, and their Cramer-Rao bound
  double ratio_fourth = 0, nees_square = 0;  ///< sums of squares of the two, for their standard errors
  std::array<double, 3> error_square{};      ///< x, y (mm2) and theta (rad2) at the centroid
  std::vector<double> ms;                    ///< CPU time of each trial
  /// Why a good pose was refused or a wrong one accepted: "cause seed".
  std::map<std::string, int> blunders;

  double ratio() const;
  double mean_nees() const { return nees / (3 * judged); }
  double share(int count) const { return 100.0 * count / trials; }
  /// Standard errors of the three over the trials.
  double ratio_error() const;
  double nees_error() const;
  double share_error(int count) const;
  double milliseconds(double quantile) const;
};

/// The ranges and limits that the setting needs.
localize::LocalizeOptions options_for(const Setting& setting);

/// Error (dx, dy in mm, dtheta in rad) at the centroid; of the truth's images under true symmetries the one
/// least turned.
Eigen::Vector3d error_of(const workpiece::OutlineTemplate& outline, const Pose2& truth, const Pose2& found);

/// Within 1 mm and 0.2 deg of the truth.
bool good(const Eigen::Vector3d& error);
/// Within 5 mm and 1.5 deg.
bool in_basin(const Eigen::Vector3d& error);

void judge(const workpiece::OutlineTemplate& outline, const Setting& setting, const EdgeSet& set,
           const localize::Localization& found, Tally& tally, const std::string& label);

/// CPU time of the whole program, ms: the paper's method works in several threads.
double cpu_ms();

/// Trials with seeds seed, seed + 1, ... judged.
Tally run_cell(const PartUnderTest& part, const Setting& setting, int trials, std::uint64_t seed,
               const Solve& solve);
/// As above by the product's own methods.
Solve solver_of(const PartUnderTest& part, const Setting& setting,
                localize::Method method = localize::Method::Robust);

}  // namespace weldcell::bench
