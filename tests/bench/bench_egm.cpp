// The daemon's EGM reply (send to reply) beside a bare recv/send echo in the same run, at 250 Hz and 1 kHz
// and beside stress-ng.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <optional>

#include "bench/egm/sender.hpp"
#include "bench/egm/stress.hpp"
#include "bench/rows.hpp"

namespace weldcell::bench {
namespace {

constexpr const char* kUsage =
    "usage: bench_egm [--json] [--seconds S] [--minutes M] [--no-stress]\n"
    "  --seconds S   at 250 Hz and at 1 kHz each, unloaded (default 10)\n"
    "  --minutes M   at 250 Hz beside stress-ng --cpu 2 (default 0.5)\n"
    "  --no-stress   leave the loaded part out\n"
    "exit codes: 0 every target met, 1 not all met, 2 usage\n";

struct Options {
  bool json = false, stress = true;
  double seconds = 10, stress_minutes = 0.5;
};

void add_rows(std::vector<Row>& rows, const std::string& name, Pair& pair, bool judged) {
  const auto row = [&](const char* what, const char* unit, double daemon, double echo, double target) {
    rows.push_back({name + ", " + what, daemon, unit, echo, judged ? target : NAN,
                    judged && !std::isnan(target) ? Better::Lower : Better::None});
  };
  const double echo = pair.echo.at(0.5);
  row("send to reply p50", "us", pair.daemon.at(0.5), echo, echo + 15);
  row("send to reply p99", "us", pair.daemon.at(0.99), pair.echo.at(0.99), NAN);
  row("send to reply p99.9", "us", pair.daemon.at(0.999), pair.echo.at(0.999), NAN);
  row("send to reply max", "us", pair.daemon.at(1), pair.echo.at(1), NAN);
  const double cpu = pair.echo.cpu_per_frame();
  row("CPU per frame", "us", pair.daemon.cpu_per_frame(), cpu, 1.5 * cpu);
  rows.push_back({name + ", frames sent", static_cast<double>(pair.daemon.sent), "", NAN, NAN, Better::None});
  const auto unanswered = [](const Figures& f) { return static_cast<double>(f.sent - f.answered); };
  rows.push_back({name + ", frames unanswered", unanswered(pair.daemon), "", unanswered(pair.echo), 0});
  rows.push_back({name + ", answered after half a cycle", static_cast<double>(pair.daemon.late), "",
                  static_cast<double>(pair.echo.late), NAN, Better::None});
  rows.push_back(
      {name + ", replies out of order", static_cast<double>(pair.daemon.out_of_order), "", NAN, 0});
}

std::optional<Options> options_of(int argc, char** argv) {
  Options out;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const char* next = i + 1 < argc ? argv[i + 1] : nullptr;
    double* number = word == "--seconds" ? &out.seconds : word == "--minutes" ? &out.stress_minutes : nullptr;
    if (number != nullptr) {
      char* end = nullptr;
      *number = next != nullptr ? std::strtod(next, &end) : 0;
      ++i;
      if (next != nullptr && *end == '\0' && *number > 0) continue;
      std::fprintf(stderr, "bench_egm: %s needs a number above 0\n%s", word.c_str(), kUsage);
      return std::nullopt;
    }
    if (word == "--json") {
      out.json = true;
    } else if (word == "--no-stress") {
      out.stress = false;
    } else {
      std::fprintf(stderr, "bench_egm: what is '%s'?\n%s", word.c_str(), kUsage);
      return std::nullopt;
    }
  }
  return out;
}

int run(const Options& options) {
  auto read = files::read_cell_file(WELDCELL_CONFIG "/cell-demo.yaml");
  if (const auto* faults = std::get_if<files::Faults>(&read)) {
    std::fprintf(stderr, "bench_egm: %s\n", files::text(*faults).c_str());
    return 2;
  }
  const double stress_s = options.stress ? options.stress_minutes * 60 : 0;
  Echo echo;
  Daemon daemon(std::get<files::CellConfig>(read), 2 * options.seconds + stress_s + 60);
  const bool locked = rt::lock_memory().ok();
  // Above both answerers: who measures must not be what is measured.
  sched_param above{};
  above.sched_priority = kFifo + 5;
  const bool fifo =
      pthread_setschedparam(pthread_self(), SCHED_FIFO, &above) == 0 && echo.fifo && daemon.fifo;

  std::vector<Row> rows;
  Sender sender(daemon, echo);
  sender.begin();
  Pair slow, fast, stressed;
  sender.run(250, options.seconds, slow);
  add_rows(rows, "250 Hz", slow, true);
  sender.run(1000, options.seconds, fast);
  add_rows(rows, "1 kHz", fast, true);
  if (options.stress) {
    const Stress stress(stress_s);
    Pair while_it_starts;
    sender.run(250, 1, while_it_starts);
    if (!stress.running()) {
      std::fprintf(stderr, "bench_egm: stress-ng does not run; scripts/install-packages --test\n");
      return 2;
    }
    sender.run(250, stress_s, stressed);
    add_rows(rows, "250 Hz beside stress-ng --cpu 2", stressed, false);
  }
  daemon.end();
  rows.push_back({"allocations of the egm thread", static_cast<double>(daemon.allocations), "", NAN, 0});
  rows.push_back({"references cut by a limit", static_cast<double>(daemon.report().limited), "", NAN, 0});
  rows.push_back({"plan followed to the end (1 = yes)",
                  daemon.report().phase == robot::EgmPhase::Following ? 1.0 : 0.0, "", NAN, 1,
                  Better::Higher});
  rows.push_back({"cycles lost on the way to the cell", static_cast<double>(daemon.dropped()), "", NAN, NAN,
                  Better::None});
  rows.push_back(
      {"FIFO scheduling and locked memory granted", fifo && locked ? 1.0 : 0.0, "", NAN, NAN, Better::None});
  return finish("egm", rows, options.json);
}

}  // namespace
}  // namespace weldcell::bench

int main(int argc, char** argv) {
  using namespace weldcell::bench;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--help") == 0 || std::strcmp(argv[i], "-h") == 0)
      return std::fputs(kUsage, stdout), 0;
  }
  const auto options = options_of(argc, argv);
  return options ? run(*options) : 2;
}
