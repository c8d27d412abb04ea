// Accuracy, honesty and verdicts over settings that the model covers, and where a search may miss.
#include <cmath>

#include "book.hpp"
#include "unshown.hpp"

namespace weldcell::bench {

namespace {

struct Case {
  const char* name;
  Setting setting;
  double ratio_target;
  bool members_off() const { return setting.member_mm > 0; }
  bool modelled() const { return setting.member_mm < 1; }
};

std::vector<Case> accuracy_cases() {
  Setting base, out0, out10, out30, var05, var1;
  out0.outliers = 0;
  out10.outliers = 0.1;
  out10.sigma_mm = 0.4;
  out30.outliers = 0.3;
  Setting out10_on = out10, out30_on = out30;
  out10_on.strays_on_path = out30_on.strays_on_path = true;
  var05.member_mm = 0.5, var05.member_deg = 0.125;
  var1.member_mm = 1, var1.member_deg = 0.25;
  return {{"out0", out0, 1.15},
          {"base", base, 1.15},
          {"out10", out10, 1.15},
          {"out30", out30, 1.10},
          {"out10 on the path", out10_on, 1.15},
          {"out30 on the path", out30_on, 1.10},
          {"var05", var05, 1.10},
          {"var1", var1, 1.10}};
}

/// Round edges are seen inside the outline, by how much depends on the laser.
Setting on_part(Setting setting, const PartUnderTest& part) {
  if (part.workpiece.members.front().edge_radius_mm > 0) setting.inset_mm = 0.4;
  return setting;
}

/// The localizer on the points of the part alone: what outliers cost.
Solve knowing_outliers(const PartUnderTest& part, const Setting& setting) {
  return [&part, options = options_for(setting)](const EdgeSet& set) {
    std::vector<EdgePoint> of_part;
    for (std::size_t i = 0; i < set.edges.size(); ++i) {
      if (set.edge_of_point[i] >= 0) of_part.push_back(set.edges[i]);
    }
    return part.localizer.localize(of_part, set.path, options);
  };
}

struct Sums {
  double ratio = 0;
  int cells = 0, accepted_wrong = 0, trials = 0;
};

void accuracy_cell(Book& book, const Case& c, const PartUnderTest& part, std::uint64_t seed, Sums& sums) {
  const std::string name = std::string(c.name) + " " + part.workpiece.name;
  if (!book.wanted(name)) return;
  const Setting setting = on_part(c.setting, part);
  const Tally t = run_cell(part, setting, book.options.trials, seed, solver_of(part, setting));
  const Tally paper = run_cell(part, setting, book.options.paper_trials, seed,
                               solver_of(part, setting, localize::Method::Paper));
  book.explain(name, t);
  const double target = c.members_off() && part.workpiece.members.size() <= 3 ? 1.25 : c.ratio_target;
  const double paper_ratio = paper.judged > 0 ? paper.ratio() : NAN;
  book.add(name + " RMS/" + (c.members_off() ? "GLS" : "CRLB"), t.ratio(), "1", paper_ratio, target,
           Better::Lower, t.ratio_error());
  if (c.setting.outliers >= 0.1) {
    const Tally told = run_cell(part, setting, book.options.trials, seed, knowing_outliers(part, setting));
    book.add(name + " RMS/CRLB, outliers known", told.ratio(), "1", NAN, NAN, Better::None,
             told.ratio_error());
  }
  book.add(name + " NEES", t.mean_nees(), "1", 1, 1.5, Better::Lower, t.nees_error());
  book.add(name + " NEES not too small", t.mean_nees(), "1", 1, 0.7, Better::Higher);
  book.add(name + " false accept", t.share(t.false_accept), "%", paper.share(paper.false_accept),
           c.modelled() ? 0.1 : 1.0, Better::Lower, t.share_error(t.false_accept));
  if (c.modelled()) {
    book.add(name + " false reject", t.share(t.false_reject), "%", paper.share(paper.false_reject), 5,
             Better::Lower, t.share_error(t.false_reject));
    book.add(name + " asked for another scan", t.share(t.again), "%", NAN, NAN, Better::None);
    book.add(name + " success", t.share(t.success), "%", paper.share(paper.success), 99.5, Better::Higher);
    sums.accepted_wrong += t.false_accept;
    sums.trials += t.trials;
  }
  if (!c.members_off() && c.setting.outliers <= 0.1) sums.ratio += t.ratio(), ++sums.cells;
}

void wide_cell(Book& book, const PartUnderTest& part, std::uint64_t seed) {
  const std::string name = "wide " + part.workpiece.name;
  if (!book.wanted(name)) return;
  Setting wide = on_part({}, part);
  wide.shift_mm = 50;
  const Tally t = run_cell(part, wide, book.options.trials, seed, solver_of(part, wide));
  book.explain(name, t);
  book.add(name + " basin", t.share(t.basin), "%", NAN, 100, Better::Higher);
  book.add(name + " time median", t.milliseconds(0.5), "ms", NAN, 1.0);
}

void extreme_cell(Book& book, const PartUnderTest& part, std::uint64_t seed) {
  const std::string name = "extreme " + part.workpiece.name;
  if (!book.wanted(name)) return;
  Setting extreme = on_part({}, part);
  extreme.shift_mm = 100, extreme.turn_deg = 180, extreme.outliers = 0.1;
  const Tally t = run_cell(part, extreme, book.options.trials, seed, solver_of(part, extreme));
  book.explain(name, t);
  book.add(name + " basin", t.share(t.basin), "%", NAN, 99.9, Better::Higher);
  book.add(name + " false accept", t.share(t.false_accept), "%", NAN, 0.1);
  book.add(name + " false reject", t.share(t.false_reject), "%", NAN, 5);
  book.add(name + " asked for another scan", t.share(t.again), "%", NAN, NAN, Better::None);
  book.add(name + " time median", t.milliseconds(0.5), "ms", NAN, 15);
}

void hard_cell(Book& book, const PartUnderTest& part, std::uint64_t seed, bool strays_on_path) {
  const std::string name = std::string(strays_on_path ? "hard on the path " : "hard ") + part.workpiece.name;
  // Three members less the missing one leave a direction that nothing measures.
  if (!book.wanted(name) || part.workpiece.members.size() <= 3) return;
  Setting hard = on_part({}, part);
  hard.sigma_mm = 0.4, hard.outliers = 0.3, hard.pitch_mm = 100, hard.drop_out = 0.2;
  hard.members_missing = 1, hard.member_mm = 0.5, hard.member_deg = 0.125, hard.shift_mm = 50;
  hard.strays_on_path = strays_on_path;
  const Tally t = run_cell(part, hard, book.options.trials, seed, solver_of(part, hard));
  book.explain(name, t);
  book.add(name + " basin", t.share(t.basin), "%", 96, 99.5, Better::Higher);
  book.add(name + " false accept", t.share(t.false_accept), "%", NAN, 0.1);
}

}  // namespace

void accuracy(Book& book) {
  Sums sums;
  for (const Case& c : accuracy_cases()) {
    book.each_part(
        [&](const PartUnderTest& part, std::uint64_t seed) { accuracy_cell(book, c, part, seed, sums); });
  }
  if (sums.cells > 0)
    book.add("RMS/CRLB at 0-10 % outliers, mean of cells", sums.ratio / sums.cells, "1", 1.0, 1.05);
  if (sums.trials > 0)
    book.add("false accept, modelled cases", 100.0 * sums.accepted_wrong / sums.trials, "%", NAN, 0.1);
}

void basin(Book& book) {
  book.each_part([&](const PartUnderTest& part, std::uint64_t seed) {
    wide_cell(book, part, seed);
    extreme_cell(book, part, seed);
    for (const bool strays_on_path : {false, true}) hard_cell(book, part, seed, strays_on_path);
  });
}

void latency(Book& book) {
  for (const bool spiral : {false, true}) {
    book.each_part([&](const PartUnderTest& part, std::uint64_t seed) {
      const std::string name = std::string(spiral ? "lat8 spiral " : "lat8 zigzag ") + part.workpiece.name;
      if (!book.wanted(name)) return;
      Setting s = on_part({}, part);
      s.latency_s = 0.008;
      s.spiral = spiral;
      const Tally t = run_cell(part, s, book.options.trials, seed, solver_of(part, s));
      const Tally paper =
          run_cell(part, s, book.options.paper_trials, seed, solver_of(part, s, localize::Method::Paper));
      book.explain(name, t);
      book.add(name + " success", t.share(t.success), "%", paper.share(paper.success), 100, Better::Higher);
      book.add(name + " false reject", t.share(t.false_reject), "%", paper.share(paper.false_reject), 5);
      book.add(name + " asked for another scan", t.share(t.again), "%",
               share_left_open(part, s, book.options.trials, seed), NAN, Better::None);
      book.add(name + " RMS/CRLB", t.ratio(), "1", paper.judged > 0 ? paper.ratio() : NAN, NAN, Better::None);
      book.add(name + " NEES", t.mean_nees(), "1", 1, 1.5);
      book.add(name + " latency error", 1e3 * std::sqrt(t.latency_square / t.judged), "ms",
               1e3 * std::sqrt(t.latency_limit_square / t.judged), spiral ? NAN : 0.2);
    });
  }
}

}  // namespace weldcell::bench
