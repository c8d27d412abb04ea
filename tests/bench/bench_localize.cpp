// Localization against its bounds: accuracy, honesty, basin, wrong verdicts, time; ours beside the paper's
// method on the same sets. usage: bench_localize [--json] [--quick] [--trials N] [--seed S] [--only WORD]
#include <ctime>
#include <functional>
#include <map>

#include "bench/edge_generator.hpp"
#include "bench/rows.hpp"
#include "weldcell/localize/localizer.hpp"

namespace weldcell {
namespace {

using bench::Better;
using bench::EdgeSet;
using bench::Row;
using bench::Setting;
using localize::Localization;
using localize::LocalizeOptions;
using localize::Localizer;
using localize::Verdict;

double cpu_ms() { return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

struct Options {
  bool json = false;
  int trials = 300, paper_trials = 12;
  std::uint64_t seed = 90417;
  std::string only;
};

/// Sums over the trials of one cell.
struct Tally {
  int trials = 0, success = 0, basin = 0, accepted = 0, false_accept = 0, false_reject = 0;
  double ratio_square = 0, nees = 0, latency_square = 0;
  std::array<double, 3> error_square{};
  int judged = 0;
  std::map<std::string, int> causes;
  std::vector<double> ms;

  double ratio() const { return std::sqrt(ratio_square / (3 * judged)); }
  double mean_nees() const { return nees / (3 * judged); }
  double share(int count) const { return 100.0 * count / trials; }
  double milliseconds(double quantile) {
    std::sort(ms.begin(), ms.end());
    return ms[static_cast<std::size_t>(quantile * static_cast<double>(ms.size() - 1))];
  }
};

LocalizeOptions options_for(const Setting& setting) {
  LocalizeOptions o;
  o.range_mm = std::max(50.0, setting.shift_mm);
  o.range_rad = setting.turn_deg > 20 ? kPi : rad(20);
  o.max_offset_mm = o.range_mm;
  o.max_rotation_rad = o.range_rad;
  return o;
}

/// Error of the found pose at the centroid, of the truth's images under true symmetries the closest.
Eigen::Vector3d error_of(const workpiece::OutlineTemplate& outline, const Pose2& truth, const Pose2& found) {
  const auto error = [&](const Pose2& pose) {
    const localize::Offset off = localize::offset_from_planned(outline, truth, pose);
    return Eigen::Vector3d(off.dx_mm, off.dy_mm, off.dtheta_rad);
  };
  Eigen::Vector3d best = error(found);
  for (const workpiece::Symmetry& s : outline.symmetries) {
    if (s.gap_mm != 0) continue;
    const Eigen::Vector3d other = error(found * s.map);
    if (std::abs(other.z()) < std::abs(best.z())) best = other;
  }
  return best;
}

void judge(const workpiece::OutlineTemplate& outline, const Setting& setting, const EdgeSet& set,
           const Localization& found, Tally& tally) {
  const Eigen::Vector3d e = error_of(outline, set.truth, found.pose);
  const double off = e.head<2>().norm(), turned = std::abs(deg(e.z()));
  const bool good = off <= 1 && turned <= 0.2, near = off <= 5 && turned <= 1.5;
  const bool accepted = found.verdict == Verdict::Weld;
  ++tally.trials;
  tally.success += good;
  tally.basin += near;
  tally.accepted += accepted;
  tally.false_accept += accepted && !good;
  tally.false_reject += good && !accepted;
  ++tally.causes[found.cause];
  if (!near) return;
  const Eigen::Matrix3d limit = bench::bound(outline, setting, set);
  for (int i = 0; i < 3; ++i) {
    tally.ratio_square += e(i) * e(i) / limit(i, i);
    tally.error_square[static_cast<std::size_t>(i)] += e(i) * e(i);
  }
  if (found.covariance.trace() > 0) tally.nees += e.dot(found.covariance.ldlt().solve(e));
  if (found.latency_s) tally.latency_square += std::pow(*found.latency_s - setting.latency_s, 2);
  ++tally.judged;
}

class Bench {
 public:
  explicit Bench(const Options& options) : options_(options) {}

  int run() {
    for (const workpiece::Workpiece& w : {bench::ladder(), bench::rect(), bench::nearsym(), bench::mitre(),
                                          bench::aframe(), bench::corner()}) {
      parts_.push_back({w, Localizer(*workpiece::build_template(w))});
    }
    accuracy();
    basin();
    latency();
    wrong_parts();
    members();
    time();
    return bench::finish("localize", rows_, options_.json);
  }

 private:
  struct PartUnderTest {
    workpiece::Workpiece workpiece;
    Localizer localizer;
    const workpiece::OutlineTemplate& outline() const { return localizer.outline(); }
  };

  bool wanted(const std::string& name) const {
    return options_.only.empty() || name.find(options_.only) != std::string::npos;
  }

  Tally cell(const PartUnderTest& part, const Setting& setting, int trials,
             localize::Method method = localize::Method::Robust) {
    Tally tally;
    LocalizeOptions o = options_for(setting);
    o.method = method;
    for (int i = 0; i < trials; ++i) {
      const EdgeSet set =
          bench::make_set(part.outline(), setting, options_.seed + static_cast<std::uint64_t>(i));
      const double start = cpu_ms();
      const Localization found = part.localizer.localize(set.edges, set.path, o);
      tally.ms.push_back(cpu_ms() - start);
      judge(part.outline(), setting, set, found, tally);
    }
    return tally;
  }

  void add(const std::string& name, double value, const char* unit, double reference = NAN,
           double target = NAN, Better better = Better::Lower) {
    rows_.push_back({name, value, unit, reference, target, better});
    if (!options_.json) std::fprintf(stderr, "%s %.4g %s\n", name.c_str(), value, unit);
  }

  struct Case {
    const char* name;
    Setting setting;
    double ratio_target;
  };

  void accuracy() {
    Setting base, out0, out10, out30, var05, var1;
    out0.outliers = 0;
    out10.outliers = 0.1;
    out10.sigma_mm = 0.4;
    out30.outliers = 0.3;
    var05.member_mm = 0.5, var05.member_deg = 0.125;
    var1.member_mm = 1, var1.member_deg = 0.25;
    double sum = 0, accepted_wrong = 0, accept_trials = 0;
    int cells = 0;
    for (const Case& c : {Case{"out0", out0, 1.15}, Case{"base", base, 1.15}, Case{"out10", out10, 1.15},
                          Case{"out30", out30, 1.10}, Case{"var05", var05, 1.10}, Case{"var1", var1, 1.10}}) {
      for (const PartUnderTest& part : parts_) {
        const std::string name = std::string(c.name) + " " + part.workpiece.name;
        if (!wanted(name)) continue;
        const Tally t = cell(part, c.setting, options_.trials);
        const Tally paper = cell(part, c.setting, options_.paper_trials, localize::Method::Paper);
        const bool members_off = c.setting.member_mm > 0;
        const double target = members_off && part.workpiece.members.size() == 3 ? 1.25 : c.ratio_target;
        add(name + " RMS/" + (members_off ? "GLS" : "CRLB"), t.ratio(), "1",
            paper.judged > 0 ? paper.ratio() : NAN, target);
        add(name + " NEES", t.mean_nees(), "1", 1, 1.5);
        add(name + " NEES not too small", t.mean_nees(), "1", 1, 0.7, Better::Higher);
        const bool modelled = c.setting.member_mm < 1;
        add(name + " false accept", t.share(t.false_accept), "%", paper.share(paper.false_accept),
            modelled ? 0.1 : 1.0);
        if (modelled) {
          add(name + " false reject", t.share(t.false_reject), "%", paper.share(paper.false_reject), 5);
          add(name + " success", t.share(t.success), "%", paper.share(paper.success), 99.5, Better::Higher);
          accepted_wrong += t.false_accept;
          accept_trials += t.trials;
        }
        if (!members_off && c.setting.outliers <= 0.1) sum += t.ratio(), ++cells;
      }
    }
    if (cells > 0) add("RMS/CRLB at 0-10 % outliers, mean of cells", sum / cells, "1", 1.0, 1.05);
    if (accept_trials > 0)
      add("false accept, modelled cases", 100 * accepted_wrong / accept_trials, "%", NAN, 0.1);
  }

  void basin() {
    Setting wide, extreme, hard;
    wide.shift_mm = 50;
    extreme.shift_mm = 100, extreme.turn_deg = 180, extreme.outliers = 0.1;
    hard.sigma_mm = 0.4, hard.outliers = 0.3, hard.pitch_mm = 100, hard.drop_out = 0.2,
    hard.members_missing = 1;
    hard.member_mm = 0.5, hard.member_deg = 0.125, hard.shift_mm = 50;
    for (const PartUnderTest& part : parts_) {
      const std::string& name = part.workpiece.name;
      if (wanted("wide " + name)) {
        Tally t = cell(part, wide, options_.trials);
        add("wide " + name + " basin", t.share(t.basin), "%", NAN, 100, Better::Higher);
        add("wide " + name + " time median", t.milliseconds(0.5), "ms", NAN, 1.0);
      }
      if (wanted("extreme " + name)) {
        Tally t = cell(part, extreme, options_.trials);
        add("extreme " + name + " basin", t.share(t.basin), "%", NAN, 99.9, Better::Higher);
        add("extreme " + name + " false accept", t.share(t.false_accept), "%", NAN, 0.1);
        add("extreme " + name + " false reject", t.share(t.false_reject), "%", NAN, 5);
        add("extreme " + name + " time median", t.milliseconds(0.5), "ms", NAN, 15);
      }
      // Three members less the missing one leave a direction that nothing measures.
      if (wanted("hard " + name) && part.workpiece.members.size() > 3) {
        const Tally t = cell(part, hard, options_.trials);
        add("hard " + name + " basin", t.share(t.basin), "%", 96, 99.5, Better::Higher);
        add("hard " + name + " false accept", t.share(t.false_accept), "%", NAN, 0.1);
      }
    }
  }

  void latency() {
    for (const bool spiral : {false, true}) {
      Setting s;
      s.latency_s = 0.008;
      s.spiral = spiral;
      for (const PartUnderTest& part : parts_) {
        const std::string name = std::string(spiral ? "lat8 spiral " : "lat8 zigzag ") + part.workpiece.name;
        if (!wanted(name)) continue;
        const Tally t = cell(part, s, options_.trials);
        const Tally paper = cell(part, s, options_.paper_trials, localize::Method::Paper);
        add(name + " success", t.share(t.success), "%", paper.share(paper.success), 100, Better::Higher);
        add(name + " RMS/CRLB", t.ratio(), "1", paper.judged > 0 ? paper.ratio() : NAN, NAN, Better::None);
        add(name + " NEES", t.mean_nees(), "1", 1, 1.5);
        add(name + " latency error", 1e3 * std::sqrt(t.latency_square / t.judged), "ms", NAN,
            spiral ? NAN : 0.2);
      }
    }
  }

  static workpiece::Workpiece altered(const workpiece::Workpiece& w, const std::string& how,
                                      std::mt19937_64& random) {
    workpiece::Workpiece out = w;
    const std::size_t m = random() % out.members.size();
    if (how == "mirrored") {
      for (auto& member : out.members) {
        for (Vec2& p : member.outline) p.x() = -p.x();
      }
    } else if (how == "moved") {
      const double step = random() % 2 == 0 ? 20 : -20;
      const bool sideways = random() % 2 == 0;
      const Vec2 by(sideways ? step : 0, sideways ? 0 : step);
      for (Vec2& p : out.members[m].outline) p += by;
    } else {
      out.members.erase(out.members.begin() + static_cast<std::ptrdiff_t>(m));
    }
    return *workpiece::validated(out);
  }

  void wrong_parts() {
    const std::map<std::string, std::string> expected{
        {"mirrored", "mirrored"}, {"moved", "wrong_revision"}, {"missing", "member_missing"}};
    for (const auto& [how, cause] : expected) {
      for (const PartUnderTest& part : parts_) {
        const std::string& name = part.workpiece.name;
        // These are their own mirror images (turned by 180 degrees at most).
        if (how == "mirrored" && (name == "rect" || name == "nearsym" || name == "aframe")) continue;
        if (!wanted(how + " " + name)) continue;
        std::mt19937_64 random(options_.seed);
        int accepted = 0, named = 0;
        const int trials = std::min(options_.trials, 100);
        std::map<std::string, int> causes;
        for (int i = 0; i < trials; ++i) {
          const auto other = workpiece::build_template(altered(part.workpiece, how, random));
          const EdgeSet set =
              bench::make_set(*other, Setting{}, options_.seed + static_cast<std::uint64_t>(i));
          const Localization found = part.localizer.localize(set.edges, set.path, options_for(Setting{}));
          accepted += found.verdict == Verdict::Weld;
          named += found.cause == cause;
          ++causes[found.cause];
        }
        for (const auto& [c, n] : causes) {
          if (!options_.json)
            std::fprintf(stderr, "    %s %s: %s %d\n", how.c_str(), name.c_str(), c.c_str(), n);
        }
        add(how + " " + name + " accepted", 100.0 * accepted / trials, "%", NAN, 0);
        add(how + " " + name + " cause named right", 100.0 * named / trials, "%", NAN, 95, Better::Higher);
      }
    }
  }

  /// One rung of the ladder off by 0.5 to 5 mm across itself.
  void members() {
    if (!wanted("member offset")) return;
    const PartUnderTest& part = parts_.front();
    std::mt19937_64 random(options_.seed);
    double square = 0, worst = 0;
    for (int i = 0; i < options_.trials; ++i) {
      const double by =
          (0.5 + 4.5 * static_cast<double>(random() % 1000) / 999) * (random() % 2 == 0 ? 1 : -1);
      const std::size_t m = 2 + random() % 4;
      workpiece::OutlineTemplate moved = part.outline();
      for (auto& e : moved.edges) {
        if (e.member == static_cast<int>(m)) e.line.a.x() += by, e.line.b.x() += by;
      }
      const EdgeSet set = bench::make_set(moved, Setting{}, options_.seed + static_cast<std::uint64_t>(i));
      const Localization found = part.localizer.localize(set.edges, set.path, options_for(Setting{}));
      const Vec2 shift =
          Pose2{0, 0, -found.pose.theta_rad}.rotate({found.members[m].dx_mm, found.members[m].dy_mm});
      square += (shift.x() - by) * (shift.x() - by);
      worst = std::max(worst, std::abs(shift.x() - by));
    }
    add("member offset 0.5-5 mm, RMS error", std::sqrt(square / options_.trials), "mm", NAN, 0.15);
    add("member offset 0.5-5 mm, largest error", worst, "mm", NAN, NAN, Better::None);
  }

  void time() {
    if (!wanted("time")) return;
    const PartUnderTest& ladder = parts_.front();
    Setting wide;
    wide.shift_mm = 50;
    for (const double pitch : {140.0, 70.0, 40.0, 15.0, 7.5, 3.0, 1.5}) {
      wide.pitch_mm = pitch;
      Tally t = cell(ladder, wide, std::min(options_.trials, pitch < 10 ? 20 : 100));
      const EdgeSet set = bench::make_set(ladder.outline(), wide, options_.seed);
      const std::string name = "time " + std::to_string(set.edges.size()) + " points";
      const double target = set.edges.size() <= 320 ? 1.0 : (set.edges.size() <= 2000 ? 3.0 : NAN);
      add(name + " median", t.milliseconds(0.5), "ms", NAN, target);
      add(name + " p99", t.milliseconds(0.99), "ms", NAN, NAN, Better::None);
    }
    wide.pitch_mm = 40;
    Tally ours = cell(ladder, wide, std::min(options_.trials, 20));
    Tally paper = cell(ladder, wide, std::min(options_.trials, 10), localize::Method::Paper);
    add("time paper / ours, 200 points", paper.milliseconds(0.5) / ours.milliseconds(0.5), "x", NAN, 10,
        Better::Higher);
    for (const int rungs : {2, 8, 30, 98}) {
      const workpiece::Workpiece w = bench::comb(rungs);
      const double start = cpu_ms();
      const PartUnderTest part{w, Localizer(*workpiece::build_template(w))};
      const double offline = cpu_ms() - start;
      Setting s;
      s.pitch_mm = 80;
      Tally t = cell(part, s, std::min(options_.trials, 40));
      const EdgeSet set = bench::make_set(part.outline(), s, options_.seed);
      const std::string name = "time " + std::to_string(rungs + 2) + " members";
      add(name + " median a point", 1e3 * t.milliseconds(0.5) / static_cast<double>(set.edges.size()), "us",
          NAN, NAN, Better::None);
      add(name + " template offline", offline, "ms", NAN, NAN, Better::None);
      add(name + " memory", static_cast<double>(part.localizer.memory_bytes()) / 1e6, "MB", NAN, 10);
    }
  }

  Options options_;
  std::vector<PartUnderTest> parts_;
  std::vector<Row> rows_;
};

}  // namespace
}  // namespace weldcell

int main(int argc, char** argv) {
  weldcell::Options options;
  options.json = weldcell::bench::wants_json(argc, argv);
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const bool more = i + 1 < argc;
    if (word == "--quick") options.trials = 30, options.paper_trials = 2;
    if (word == "--trials" && more) options.trials = std::max(1, std::atoi(argv[i + 1]));
    if (word == "--seed" && more) options.seed = std::strtoull(argv[i + 1], nullptr, 10);
    if (word == "--only" && more) options.only = argv[i + 1];
  }
  return weldcell::Bench(options).run();
}
