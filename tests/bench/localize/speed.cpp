// Time against points, members and threads, and against the paper's method.
#include <chrono>
#include <thread>

#include "book.hpp"
#include "weldments.hpp"

namespace weldcell::bench {

namespace {

Setting wide_setting(double pitch_mm) {
  Setting wide;
  wide.shift_mm = 50;
  wide.pitch_mm = pitch_mm;
  return wide;
}

/// From about 50 to 5000 points on the ladder.
void growth_with_points(Book& book) {
  const PartUnderTest& ladder = book.known.front();
  for (const double pitch : {140.0, 70.0, 40.0, 15.0, 7.5, 3.0, 1.5}) {
    const Setting wide = wide_setting(pitch);
    const Tally t = run_cell(ladder, wide, std::min(book.options.trials, pitch < 10 ? 50 : 300),
                             book.options.seed, solver_of(ladder, wide));
    const std::size_t points = make_set(ladder.outline(), wide, book.options.seed).edges.size();
    const std::string name = "time " + std::to_string(points) + " points";
    const double target = points <= 320 ? 1.0 : (points <= 2000 ? 3.0 : NAN);
    book.add(name + " min", t.milliseconds(0), "ms", NAN, NAN, Better::None);
    book.add(name + " median", t.milliseconds(0.5), "ms", NAN, target);
    book.add(name + " p99", t.milliseconds(0.99), "ms", NAN, NAN, Better::None);
  }
}

void against_paper(Book& book) {
  const PartUnderTest& ladder = book.known.front();
  const Setting wide = wide_setting(40);
  // Each set by both, one after the other, so that the machine's mood falls on both.
  std::vector<double> ratios;
  const Solve ours = solver_of(ladder, wide), paper = solver_of(ladder, wide, localize::Method::Paper);
  for (int i = 0; i < std::min(book.options.trials, 20); ++i) {
    const EdgeSet set = make_set(ladder.outline(), wide, book.options.seed + static_cast<std::uint64_t>(i));
    const double start = cpu_ms();
    ours(set);
    const double between = cpu_ms();
    paper(set);
    ratios.push_back((cpu_ms() - between) / (between - start));
  }
  std::sort(ratios.begin(), ratios.end());
  book.add("time paper / ours, 200 points", ratios[ratios.size() / 2], "x", NAN, 10, Better::Higher);
}

/// Sets localized per second by `threads` threads over the same sets, best of three rounds.
double throughput(const PartUnderTest& part, const std::vector<EdgeSet>& sets, std::size_t threads) {
  const localize::LocalizeOptions options = options_for(wide_setting(40));
  double best = 0;
  for (int round = 0; round < 3; ++round) {
    const auto start = std::chrono::steady_clock::now();
    std::vector<std::thread> workers;
    for (std::size_t t = 0; t < threads; ++t) {
      workers.emplace_back([&] {
        for (const EdgeSet& set : sets) part.localizer.localize(set.edges, set.path, options);
      });
    }
    for (std::thread& worker : workers) worker.join();
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
    best = std::max(best, static_cast<double>(threads * sets.size()) / spent.count());
  }
  return best;
}

void threads(Book& book) {
  const PartUnderTest& ladder = book.known.front();
  std::vector<EdgeSet> sets;
  for (int i = 0; i < std::min(book.options.trials, 300); ++i) {
    sets.push_back(
        make_set(ladder.outline(), wide_setting(40), book.options.seed + static_cast<std::uint64_t>(i)));
  }
  const double one = throughput(ladder, sets, 1), two = throughput(ladder, sets, 2);
  book.add("time 1 thread, sets a second", one, "1/s", NAN, NAN, Better::None);
  book.add("time 2 threads, sets a second", two, "1/s", NAN, NAN, Better::None);
  book.add("time 2 threads / 1 thread, throughput", two / one, "x", 2, NAN, Better::None);
}

/// From 4 to 100 members, and two.
void growth_with_members(Book& book) {
  std::vector<workpiece::Workpiece> parts;
  for (const PartUnderTest& part : book.unseen) {
    if (part.workpiece.members.size() == 2 && parts.empty()) parts.push_back(part.workpiece);
  }
  for (const int rungs : {2, 8, 30, 98}) parts.push_back(comb(rungs));
  for (const workpiece::Workpiece& workpiece : parts) {
    const double start = cpu_ms();
    const PartUnderTest part = part_under_test(workpiece);
    const double offline = cpu_ms() - start;
    Setting s;
    s.pitch_mm = 60;
    const Tally t =
        run_cell(part, s, std::min(book.options.trials, 50), book.options.seed, solver_of(part, s));
    const std::size_t points = make_set(part.outline(), s, book.options.seed).edges.size();
    const std::string name = "time " + std::to_string(part.workpiece.members.size()) + " members";
    book.add(name + " median", t.milliseconds(0.5), "ms", NAN, NAN, Better::None);
    book.add(name + " p99", t.milliseconds(0.99), "ms", NAN, NAN, Better::None);
    book.add(name + " median a point", 1e3 * t.milliseconds(0.5) / static_cast<double>(points), "us", NAN,
             NAN, Better::None);
    book.add(name + " template offline", offline, "ms", NAN, NAN, Better::None);
    book.add(name + " memory", static_cast<double>(part.localizer.memory_bytes()) / 1e6, "MB", NAN, 10);
  }
}

}  // namespace

void speed(Book& book) {
  if (!book.wanted("time")) return;
  growth_with_points(book);
  against_paper(book);
  threads(book);
  growth_with_members(book);
}

}  // namespace weldcell::bench
