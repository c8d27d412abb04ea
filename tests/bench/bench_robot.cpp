// The arm in figures: kinematics against the reference vectors and against itself, tracking of the simulated
// controller by the shipped RAPID module, the rate of its requests, and the limits as properties of random
// motions.
#include <cstdlib>
#include <cstring>

#include "bench/robot/parts.hpp"

namespace {

constexpr const char* kUsage =
    "usage: bench_robot [--json] [--plans N]\n"
    "  --plans N   the random motions alone, N of them (without it 10000, and all the rest)\n"
    "exit codes: 0 every target met, 1 not all met, 2 usage\n";

struct Options {
  bool json = false;
  int plans = 0;  ///< 0: not asked for
};

int refuse(const char* what) {
  std::fprintf(stderr, "bench_robot: %s\n%s", what, kUsage);
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace weldcell;
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--help" || word == "-h") return std::fputs(kUsage, stdout), 0;
    if (word == "--json") {
      options.json = true;
    } else if (word == "--plans") {
      options.plans = i + 1 < argc ? std::atoi(argv[++i]) : 0;
      if (options.plans <= 0) return refuse("--plans needs a number above 0, e.g. --plans 10000");
    } else {
      return refuse(("what is '" + word + "'?").c_str());
    }
  }
  auto read = files::read_cell_file(WELDCELL_CONFIG "/cell-demo.yaml");
  if (const auto* faults = std::get_if<files::Faults>(&read)) {
    std::fprintf(stderr, "bench_robot: %s\n", files::text(*faults).c_str());
    return 2;
  }
  const auto& config = std::get<files::CellConfig>(read);
  std::vector<bench::Row> rows;
  if (options.plans == 0) {
    bench::against_references(rows);
    bench::against_chains(rows);
    bench::against_itself(rows);
    bench::tracking(rows, config);
    bench::rws_rate(rows, config);
  }
  bench::random_plans(rows, config.setup, options.plans > 0 ? options.plans : 10000);
  return bench::finish("robot", rows, options.json);
}
