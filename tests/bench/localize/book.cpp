#include "book.hpp"

#include <algorithm>

#include "weldments.hpp"

namespace weldcell::bench {

Book::Book(BenchOptions o) : options(std::move(o)) {
  for (const workpiece::Workpiece& w : known_weldments()) known.push_back(part_under_test(w));
  for (const workpiece::Workpiece& w : unseen_weldments()) unseen.push_back(part_under_test(w));
}

bool Book::wanted(const std::string& name) const {
  return options.only.empty() ||
         std::any_of(options.only.begin(), options.only.end(),
                     [&](const std::string& word) { return name.find(word) != std::string::npos; });
}

void Book::add(const std::string& name, double value, const char* unit, double reference, double target,
               Better better, double standard_error) {
  rows.push_back({name, value, unit, reference, target, better, standard_error});
  if (options.json) return;
  std::fprintf(stderr, "%s %.4g", name.c_str(), value);
  if (!std::isnan(standard_error)) std::fprintf(stderr, " +- %.2g", standard_error);
  std::fprintf(stderr, " %s\n", unit);
}

void Book::explain(const std::string& cell, const Tally& tally) const {
  if (options.json) return;
  for (const auto& [what, count] : tally.blunders)
    std::fprintf(stderr, "    %s: %s%s\n", cell.c_str(), what.c_str(), count > 1 ? " (again)" : "");
}

}  // namespace weldcell::bench
