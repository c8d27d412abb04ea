// What a scan did not look at: how often a scan must be followed by another, what the lines asked for then
// prove, and what passes laid by the planner prove at once.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <random>
#include <string>

#include "book.hpp"
#include "planned_scan.hpp"
#include "unshown.hpp"
#include "weldments.hpp"

namespace weldcell::bench {

namespace {

using localize::Localization;
using localize::Verdict;

double length_of(const std::vector<PathPiece>& path) {
  double out = 0;
  for (const PathPiece& p : path) out += std::hypot(p.x1_mm - p.x0_mm, p.y1_mm - p.y0_mm);
  return out;
}

/// Whether a lengthened part's end lies in a joint, where from above it is the part as drawn but for what
/// peeps out at a corner.
bool grows_into_a_joint(const workpiece::OutlineTemplate& drawn, const workpiece::OutlineTemplate& longer) {
  for (std::size_t m = 0; m < drawn.members.size(); ++m) {
    const Polygon &was = drawn.members[m], &is = longer.members[m];
    for (std::size_t k = 0; k < was.size(); ++k) {
      const std::size_t next = (k + 1) % was.size();
      if ((was[k] - is[k]).norm() < 1 || (was[next] - is[next]).norm() < 1) continue;
      double shown = 0;
      for (const workpiece::VisibleEdge& e : drawn.edges) {
        if (e.member == static_cast<int>(m) && e.side == static_cast<int>(k)) shown += e.line.length();
      }
      return shown < 0.5 * (was[next] - was[k]).norm();
    }
  }
  return false;
}

/// A scan and, where the verdict asks for lines, a second one of these lines at the pose found, with the
/// evidence of both.
struct Looks {
  Localization first, last;
  double scanned_mm = 0, added_mm = 0;
  bool open = false;  ///< the first scan leaves open what no rule can tell
};

Looks look(const PartUnderTest& part, const workpiece::OutlineTemplate& there, const Setting& setting,
           std::uint64_t seed, std::span<const PathPiece> path) {
  Looks out;
  EdgeSet set = make_set(there, setting, seed, path);
  localize::LocalizeOptions options = options_for(setting);
  // As the cell asks of the passes that it lays itself.
  if (!path.empty()) options.prove_shift_mm = 10, options.prove_free_ends = true;
  out.first = out.last = part.localizer.localize(set.edges, set.path, options);
  out.scanned_mm = length_of(set.path);
  out.open = leaves_something_open(part, set, options);
  if (out.first.rescan.empty()) return out;
  std::vector<PathPiece> lines;
  for (const localize::ScanLine& line : out.first.rescan) {
    const Vec2 a = out.first.pose * line.from, b = out.first.pose * line.to;
    lines.push_back({a.x(), a.y(), b.x(), b.y()});
  }
  out.added_mm = length_of(lines);
  // The same seed lays the part down at the same place.
  const EdgeSet more = make_set(there, setting, seed, lines);
  set.edges.insert(set.edges.end(), more.edges.begin(), more.edges.end());
  set.path.insert(set.path.end(), more.path.begin(), more.path.end());
  out.last = part.localizer.localize(set.edges, set.path, options);
  return out;
}

struct Sums {
  int trials = 0, welded = 0, again = 0, rejected = 0, welded_after = 0, lines = 0, open = 0;
  double scanned_mm = 0, added_mm = 0;
  std::map<std::string, int> asked;  ///< scans by line asked for, or by cause where none was

  void add(const Looks& l) {
    ++trials;
    welded += l.first.verdict == Verdict::Weld;
    again += l.first.verdict == Verdict::Rescan;
    rejected += l.first.verdict == Verdict::Reject;
    welded_after += l.last.verdict == Verdict::Weld;
    lines += static_cast<int>(l.first.rescan.size());
    open += l.open;
    scanned_mm += l.scanned_mm, added_mm += l.added_mm;
    if (l.first.verdict != Verdict::Weld && l.first.rescan.empty()) ++asked[l.first.cause];
    for (const localize::ScanLine& line : l.first.rescan) {
      // Of lines that differ by where the member was found only one is told.
      const auto rounded = [](double mm) { return 10 * static_cast<int>(std::lround(mm / 10)); };
      ++asked[line.member + " (" + std::to_string(rounded(line.from.x())) + ", " +
              std::to_string(rounded(line.from.y())) + ") to (" + std::to_string(rounded(line.to.x())) +
              ", " + std::to_string(rounded(line.to.y())) + ")"];
    }
  }
  double share(double n) const { return 100 * n / trials; }
};

/// How the part is scanned: as the development sets are, or by the product's own passes over the planned pose
/// of a part laid down as the projector guides one.
struct Scan {
  const char* name;
  bool planned;
};
constexpr Scan kScans[] = {{"raster", false}, {"planned", true}};

Setting setting_of(const Scan& scan, const PartUnderTest& part) {
  Setting s;
  if (part.workpiece.members.front().edge_radius_mm > 0) s.inset_mm = 0.4;
  if (scan.planned) s.shift_mm = 8, s.turn_deg = 0.5;
  return s;
}

void good_parts(Book& book, const Scan& scan, const PartUnderTest& part, std::uint64_t seed) {
  const std::string name = std::string("proof ") + scan.name + " " + part.workpiece.name;
  if (!book.wanted(name)) return;
  const Setting s = setting_of(scan, part);
  const std::vector<PathPiece> path = scan.planned ? planned_scan(part.workpiece) : std::vector<PathPiece>{};
  Sums sums;
  for (int i = 0; i < book.options.trials; ++i) {
    const std::uint64_t one = seed + static_cast<std::uint64_t>(i);
    const Looks l = look(part, part.outline(), s, one, path);
    sums.add(l);
    if (l.last.verdict != Verdict::Weld && !book.options.json)
      std::fprintf(stderr, "    %s: seed %d %s\n", name.c_str(), static_cast<int>(one),
                   l.last.reason.c_str());
  }
  for (const auto& [line, count] : sums.asked) {
    if (!book.options.json) std::fprintf(stderr, "    %s: %d x %s\n", name.c_str(), count, line.c_str());
  }
  book.add(name + ", rejected", sums.share(sums.rejected), "%", NAN, scan.planned ? 1 : 5);
  book.add(name + ", asked for another scan", sums.share(sums.again), "%", sums.share(sums.open),
           scan.planned ? 5 : NAN, scan.planned ? Better::Lower : Better::None);
  book.add(name + ", welded after the lines asked for", sums.share(sums.welded_after), "%", NAN, 95,
           Better::Higher);
  book.add(name + ", path added by them", 100 * sums.added_mm / sums.scanned_mm, "%", NAN, NAN, Better::None);
  if (!scan.planned) return;
  book.add(name + ", passes over ends, share of the path", 100 * end_pass_share(part.workpiece), "%", NAN,
           NAN, Better::None);
}

void wrong_parts_in(Book& book, const Scan& scan, Wrong how, const PartUnderTest& part, std::uint64_t seed) {
  const std::string name =
      std::string("proof ") + scan.name + " " + to_string(how) + " " + part.workpiece.name;
  if (!book.wanted(name)) return;
  const Setting s = setting_of(scan, part);
  const std::vector<PathPiece> path = scan.planned ? planned_scan(part.workpiece) : std::vector<PathPiece>{};
  std::mt19937_64 random(seed);
  Sums sums;
  int joints = 0;
  for (int i = 0; i < std::min(book.options.trials, 100); ++i) {
    const auto other = altered(part.workpiece, how, random());
    if (!other) continue;
    const auto outline = workpiece::build_template(other->part);
    if (how == Wrong::Lengthened && grows_into_a_joint(part.outline(), *outline)) {
      ++joints;
      continue;
    }
    const std::uint64_t one = seed + static_cast<std::uint64_t>(i);
    const Looks l = look(part, *outline, s, one, path);
    sums.add(l);
    if (l.last.verdict == Verdict::Weld && !book.options.json)
      std::fprintf(stderr, "    %s accepted: %s, seed %d\n", name.c_str(), other->what.c_str(),
                   static_cast<int>(one));
  }
  if (how == Wrong::Lengthened)
    book.add(name + ", into a joint, left out", 100.0 * joints / std::max(1, joints + sums.trials), "%", NAN,
             NAN, Better::None);
  if (sums.trials == 0) return;
  // An open end that is longer changes no joint; only the passes that the planner lays are held to show it.
  const bool judged = how != Wrong::Lengthened || scan.planned;
  book.add(name + ", accepted", sums.share(sums.welded), "%", NAN, judged ? 0 : NAN,
           judged ? Better::Lower : Better::None);
  book.add(name + ", accepted after the lines asked for", sums.share(sums.welded_after), "%", NAN,
           judged ? 0 : NAN, judged ? Better::Lower : Better::None);
}

}  // namespace

void proof(Book& book) {
  for (const Scan& scan : kScans) {
    book.each_part(
        [&](const PartUnderTest& part, std::uint64_t seed) { good_parts(book, scan, part, seed); });
    for (const Wrong how : {Wrong::Moved, Wrong::Swapped, Wrong::Lengthened}) {
      book.each_part([&](const PartUnderTest& part, std::uint64_t seed) {
        wrong_parts_in(book, scan, how, part, seed);
      });
    }
  }
}

}  // namespace weldcell::bench
