// Localization against its bounds: accuracy, honesty, basin, wrong verdicts, members, time; ours beside the
// paper's method on the same sets.
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "localize/book.hpp"

namespace {

constexpr const char* kUsage =
    "usage: bench_localize [--json] [--trials N] [--quick] [--seed S] [--only WORD] [--rows FILE]\n"
    "  --trials N    scans a cell (default 300); the paper's method gets 12, a wrong part at most 100\n"
    "  --quick       30 scans a cell, 2 for the paper's method\n"
    "  --only WORD   cells whose name holds WORD: base, extreme, mirrored, tee, random, proof, joint gap, "
    "pcl, "
    "paper table, frontier, time;\n"
    "                may be given more than once\n"
    "  --rows FILE   also write the rows to FILE as JSON (scripts/bench localize --svg FILE draws them)\n"
    "exit codes: 0 every target met, 1 not all met, 2 usage\n";

/// False, told on stderr, when the file cannot be written.
bool write_rows(const weldcell::bench::Book& book) {
  const std::string& path = book.options.rows_file;
  if (path.empty()) return true;
  std::FILE* out = std::fopen(path.c_str(), "w");
  if (out == nullptr) {
    std::fprintf(stderr, "bench_localize: cannot write '%s': %s\n", path.c_str(), std::strerror(errno));
    return false;
  }
  weldcell::bench::print_json(out, "localize", book.rows);
  return std::fclose(out) == 0;
}

int refuse(const char* word) {
  std::fprintf(stderr, "bench_localize: what is '%s'?\n%s", word, kUsage);
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  weldcell::bench::BenchOptions options;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const char* next = i + 1 < argc ? argv[i + 1] : nullptr;
    if (word == "--help" || word == "-h") return std::fputs(kUsage, stdout), 0;
    if (word == "--json") {
      options.json = true;
    } else if (word == "--quick") {
      options.trials = 30, options.paper_trials = 2;
    } else if (word == "--trials" && next != nullptr) {
      options.trials = std::atoi(argv[++i]);
      if (options.trials < 1) return refuse(next);
    } else if (word == "--seed" && next != nullptr) {
      options.seed = std::strtoull(argv[++i], nullptr, 10);
    } else if (word == "--rows" && next != nullptr) {
      options.rows_file = argv[++i];
    } else if (word == "--only" && next != nullptr) {
      options.only.push_back(argv[++i]);
    } else {
      return refuse(argv[i]);
    }
  }
  weldcell::bench::Book book(options);
  weldcell::bench::accuracy(book);
  weldcell::bench::frontier(book);
  weldcell::bench::basin(book);
  weldcell::bench::latency(book);
  weldcell::bench::wrong_parts(book);
  weldcell::bench::proof(book);
  weldcell::bench::random_weldments(book);
  weldcell::bench::members(book);
  weldcell::bench::peers(book);
  weldcell::bench::paper_table(book);
  weldcell::bench::speed(book);
  if (!write_rows(book)) return 2;
  return weldcell::bench::finish("localize", book.rows, options.json);
}
