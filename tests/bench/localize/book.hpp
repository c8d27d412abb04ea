// What every section of the localization bench shares: its options, the parts, the rows and the points to
// plot.
#pragma once

#include <string>
#include <vector>

#include "bench/rows.hpp"
#include "judge.hpp"

namespace weldcell::bench {

struct BenchOptions {
  bool json = false;
  int trials = 300;
  int paper_trials = 12;  ///< the paper's method takes a hundred times longer
  std::uint64_t seed = 90417;
  std::string rows_file;          ///< also write the rows there as JSON, empty: not
  std::vector<std::string> only;  ///< cells whose name holds one of these words; none: all
};

class Book {
 public:
  explicit Book(BenchOptions options);

  const BenchOptions options;
  std::vector<PartUnderTest> known, unseen;
  std::vector<Row> rows;

  /// Calls section(part, first seed) for the known parts and for the unseen ones, which have their own seeds.
  template <typename Section>
  void each_part(Section section) const {
    for (const PartUnderTest& part : known) section(part, options.seed);
    for (const PartUnderTest& part : unseen) section(part, options.seed + kUnseenSeeds);
  }

  bool wanted(const std::string& name) const;
  void add(const std::string& name, double value, const char* unit, double reference = NAN,
           double target = NAN, Better better = Better::Lower, double standard_error = NAN);
  /// The trials of a cell that went wrong, for whoever has to find out why; to stderr, not in --json.
  void explain(const std::string& cell, const Tally& tally) const;

 private:
  static constexpr std::uint64_t kUnseenSeeds = 5'000'000;
};

// The sections; each adds its rows and leaves out cells that are not wanted.
void accuracy(Book& book);          // RMS against the bound, NEES, wrong verdicts
void frontier(Book& book);          // what any rule can reach with two to five members
void basin(Book& book);             // wide and extreme placements, the hard set
void latency(Book& book);           // 8 ms between robot and sensor
void wrong_parts(Book& book);       // mirrored, moved, missing, swapped, lengthened, turned
void proof(Book& book);             // what a scan did not look at, and the lines that mend it
void random_weldments(Book& book);  // a new weldment for every trial
void members(Book& book);           // members off the drawing, gaps of joints
void peers(Book& book);             // the Point Cloud Library's ICP on the same scans
void paper_table(Book& book);       // the paper's Table 1, its method and ours on the same scans
void speed(Book& book);             // points, members, threads, against the paper's method

}  // namespace weldcell::bench
