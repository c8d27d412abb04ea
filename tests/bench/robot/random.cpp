#include <cstdio>

#include "bench/random_plans.hpp"
#include "bench/robot/parts.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::bench {

namespace fs = std::filesystem;

void random_plans(std::vector<Row>& rows, const cell::CellSetup& demo, int count) {
  std::vector<cell::CellSetup> cells;
  for (const fs::path& path : files_in(WELDCELL_CONFIG "/robots", ".yaml")) {
    cells.push_back(demo);
    cells.back().arm = arm_of(path);
  }
  std::mt19937_64 random(kSeed);
  PlanTally tally;
  for (int n = 0; n < count; ++n) {
    // Of twenty motions one is a spiral and two are lines, which take longest.
    const int turn = n % 20;
    const Motion motion = turn == 0 ? Motion::Spiral : turn < 3 ? Motion::Line : Motion::PointToPoint;
    try_plan(cells[static_cast<std::size_t>(n) % cells.size()], motion, random, tally);
  }
  const std::string seed = " (seed " + std::to_string(kSeed) + ")";
  rows.push_back({"random motions asked for" + seed, static_cast<double>(count), "", NAN, NAN, Better::None});
  for (std::size_t k = 0; k < kMotionNames.size(); ++k) {
    rows.push_back({std::string("planned: ") + kMotionNames[k], static_cast<double>(tally.planned[k]), "",
                    NAN, 1, Better::Higher});
  }
  for (const auto& [cause, times] : tally.refused)
    rows.push_back({"refused, " + cause, static_cast<double>(times), "", NAN, NAN, Better::None});
  if (tally.broken > 0) std::fprintf(stderr, "bench_robot: first broken: %s\n", tally.first_broken.c_str());
  rows.push_back({"plans that break a limit", static_cast<double>(tally.broken), "", NAN, 0});
  const Shares& w = tally.worst;
  const double most = 1 + kShareSlack;
  rows.push_back({"worst share of a speed limit, stated", w.stated_speed, "", NAN, most});
  rows.push_back({"worst share of an acceleration limit, stated", w.stated_acceleration, "", NAN, most});
  rows.push_back({"worst share of a jerk limit, stated", w.stated_jerk, "", NAN, most});
  rows.push_back({"worst share of a speed limit, differences", w.speed, "", NAN, most});
  rows.push_back({"worst share of an acceleration limit, differences", w.acceleration, "", NAN, most});
  rows.push_back({"worst share of a jerk limit, differences", w.jerk, "", NAN, most});
  rows.push_back({"closest to a joint's range less margin", deg(w.range_excess_rad), "deg", NAN, 1e-7});
  rows.push_back({"speed at either end, stated", deg(w.end_speed_rad_s), "deg/s", NAN, 1e-4});
}

}  // namespace weldcell::bench
