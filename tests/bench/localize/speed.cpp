// Time against points, members and threads, and against the paper's method.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
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

/// Median time of each stage and of the whole over sets of about so many points, ms.
void stages(Book& book, const std::string& name, const PartUnderTest& part, const Setting& setting,
            int trials) {
  constexpr std::array<const char*, 5> kNames{"search", "polish", "refine", "rivals", "verdict"};
  std::array<std::vector<double>, kNames.size()> spent;
  const localize::LocalizeOptions options = options_for(setting);
  for (int i = 0; i < trials; ++i) {
    const EdgeSet set = make_set(part.outline(), setting, book.options.seed + static_cast<std::uint64_t>(i));
    double last = cpu_ms();
    part.localizer.localize(set.edges, set.path, options, [&](localize::Stage stage) {
      const double now = cpu_ms();
      spent[static_cast<std::size_t>(stage)].push_back(now - last);
      last = now;
    });
  }
  for (std::size_t k = 0; k < kNames.size(); ++k) {
    if (spent[k].empty()) continue;
    const auto middle = spent[k].begin() + static_cast<std::ptrdiff_t>(spent[k].size() / 2);
    std::nth_element(spent[k].begin(), middle, spent[k].end());
    book.add(name + " median of " + kNames[k], *middle, "ms", NAN, NAN, Better::None);
  }
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
    stages(book, name, ladder, wide, std::min(book.options.trials, 50));
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

/// The lines' distance at which a part shows about this many points.
double pitch_for(const PartUnderTest& part, std::size_t points, std::uint64_t seed) {
  double low = 4, high = 600;
  for (int step = 0; step < 12; ++step) {
    Setting s;
    s.pitch_mm = std::sqrt(low * high);
    (make_set(part.outline(), s, seed).edges.size() > points ? low : high) = s.pitch_mm;
  }
  return std::sqrt(low * high);
}

/// From 2 to 100 members: at lines 60 mm apart, where points grow with members, and at the same number of
/// points.
void growth_with_members(Book& book) {
  constexpr std::size_t kSamePoints = 800;
  std::vector<workpiece::Workpiece> parts;
  for (const PartUnderTest& part : book.unseen) {
    if (part.workpiece.members.size() == 2 && parts.empty()) parts.push_back(part.workpiece);
  }
  for (const int rungs : {2, 8, 30, 98}) parts.push_back(comb(rungs));
  double fewest_members = 0, same = 0;
  for (const workpiece::Workpiece& workpiece : parts) {
    if (!book.wanted("time members " + std::to_string(workpiece.members.size()))) continue;
    const double start = cpu_ms();
    const PartUnderTest part = part_under_test(workpiece);
    const double offline = cpu_ms() - start;
    const int trials = std::min(book.options.trials, 50);
    Setting s;
    s.pitch_mm = 60;
    const Tally t = run_cell(part, s, trials, book.options.seed, solver_of(part, s));
    const std::size_t points = make_set(part.outline(), s, book.options.seed).edges.size();
    const std::string name = "time " + std::to_string(part.workpiece.members.size()) + " members";
    book.add(name + " median", t.milliseconds(0.5), "ms", NAN, NAN, Better::None);
    book.add(name + " p99", t.milliseconds(0.99), "ms", NAN, NAN, Better::None);
    if (part.workpiece.members.size() == 100)
      book.add(name + " success", t.share(t.success), "%", NAN, 99.5, Better::Higher,
               t.share_error(t.success));
    book.explain(name, t);
    book.add(name + " median a point", 1e3 * t.milliseconds(0.5) / static_cast<double>(points), "us", NAN,
             NAN, Better::None);
    s.pitch_mm = pitch_for(part, kSamePoints, book.options.seed);
    same = run_cell(part, s, trials, book.options.seed, solver_of(part, s)).milliseconds(0.5);
    if (workpiece.members.size() == 2) fewest_members = same;
    book.add(name + " median at 800 points", same, "ms", NAN, NAN, Better::None);
    stages(book, name + ", 800 points,", part, s, trials);
    book.add(name + " template offline", offline, "ms", NAN, NAN, Better::None);
    book.add(name + " memory", static_cast<double>(part.localizer.memory_bytes()) / 1e6, "MB", NAN, 10);
  }
  if (fewest_members > 0)
    book.add("time 100 members / 2 members, 800 points", same / fewest_members, "x", NAN, 2);
}

}  // namespace

void speed(Book& book) {
  if (book.wanted("time points")) growth_with_points(book);
  if (book.wanted("time paper")) against_paper(book);
  if (book.wanted("time threads")) threads(book);
  growth_with_members(book);
}

}  // namespace weldcell::bench
