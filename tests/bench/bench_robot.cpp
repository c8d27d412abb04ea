// The arm in figures: kinematics against the reference vectors and against itself, tracking of the simulated
// controller by the shipped RAPID module, and the limits as properties of random motions.
// usage: bench_robot [--json] [--plans N]     default 10000; with --plans the random motions alone
#include <algorithm>
#include <cstdlib>

#include "bench/robot/parts.hpp"

namespace {

/// The N of --plans N; `fallback` without it, -1 when it is no positive number.
int plans_of(int argc, char** argv, int fallback) {
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]) != "--plans") continue;
    const int count = i + 1 < argc ? std::atoi(argv[i + 1]) : 0;
    return count > 0 ? count : -1;
  }
  return fallback;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace weldcell;
  auto read = files::read_cell_file(WELDCELL_CONFIG "/cell-demo.yaml");
  if (const auto* faults = std::get_if<files::Faults>(&read)) {
    std::fprintf(stderr, "bench_robot: %s\n", files::text(*faults).c_str());
    return 2;
  }
  const auto& config = std::get<files::CellConfig>(read);
  const bool asked =
      std::any_of(argv, argv + argc, [](const char* a) { return std::string(a) == "--plans"; });
  const int plans = plans_of(argc, argv, 10000);
  if (plans < 0) {
    std::fprintf(stderr, "bench_robot: --plans needs a number above 0, e.g. --plans 10000\n");
    return 2;
  }
  std::vector<bench::Row> rows;
  if (!asked) {
    bench::against_references(rows);
    bench::against_itself(rows);
    bench::tracking(rows, config);
  }
  bench::random_plans(rows, config.setup, plans);
  return bench::finish("robot", rows, bench::wants_json(argc, argv));
}
