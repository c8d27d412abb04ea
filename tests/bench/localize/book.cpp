#include "book.hpp"

#include "weldments.hpp"

namespace weldcell::bench {

Book::Book(BenchOptions o) : options(std::move(o)) {
  for (const workpiece::Workpiece& w : known_weldments()) known.push_back(part_under_test(w));
  for (const workpiece::Workpiece& w : unseen_weldments()) unseen.push_back(part_under_test(w));
}

void Book::add(const std::string& name, double value, const char* unit, double reference, double target,
               Better better) {
  rows.push_back({name, value, unit, reference, target, better});
  if (!options.json) std::fprintf(stderr, "%s %.4g %s\n", name.c_str(), value, unit);
}

void Book::explain(const std::string& cell, const Tally& tally) const {
  if (options.json) return;
  for (const auto& [what, count] : tally.blunders)
    std::fprintf(stderr, "    %s: %s%s\n", cell.c_str(), what.c_str(), count > 1 ? " (again)" : "");
}

}  // namespace weldcell::bench
