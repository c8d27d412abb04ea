// Parts that are not the part of the drawing, or lie turned: what is accepted, and which cause is named.
#include <cstring>
#include <random>

#include "book.hpp"
#include "weldcell/base/units.hpp"
#include "weldments.hpp"

namespace weldcell::bench {

namespace {

using localize::Localization;
using localize::Verdict;

struct Kind {
  Wrong how;
  const char* cause;  ///< nullptr: no single cause is right
};
constexpr Kind kKinds[] = {{Wrong::Mirrored, "mirrored"},
                           {Wrong::Missing, "member_missing"},
                           {Wrong::Moved, "wrong_revision"},
                           {Wrong::Swapped, nullptr},
                           {Wrong::Lengthened, nullptr}};

struct Counts {
  int trials = 0, accepted = 0, named = 0;
  int shown = 0, shown_named = 0;  ///< trials in which the scan shows that something is other than drawn
  std::map<std::string, int> causes;
  std::vector<std::string> wrong;  ///< what was accepted or given a wrong cause
};

void count(Counts& counts, const Localization& found, const char* cause, std::uint64_t seed,
           const std::string& what, bool shown = true) {
  ++counts.trials;
  const bool accepted = found.verdict == Verdict::Weld;
  // A drawing that is its own mirror image, turned by half a turn, has both for one cause: the words name
  // both.
  const bool named =
      cause != nullptr && (found.cause == cause || (std::strcmp(cause, "mirrored") == 0 &&
                                                    found.reason.find("mirror image") != std::string::npos));
  counts.accepted += accepted;
  counts.named += named;
  counts.shown += shown;
  counts.shown_named += shown && named;
  ++counts.causes[found.cause];
  if (accepted || (cause != nullptr && !named))
    counts.wrong.push_back((accepted ? "accepted: " : found.cause + ": ") + what + ", seed " +
                           std::to_string(seed));
}

/// Points of the scan that lie on what is there and farther than 5 mm from every edge of the drawing.
int telling_points(const workpiece::OutlineTemplate& drawing, const EdgeSet& set) {
  const Pose2 to_part = set.truth.inverse();
  int out = 0;
  for (std::size_t i = 0; i < set.edges.size(); ++i) {
    if (set.edge_of_point[i] < 0) continue;
    const Vec2 p = to_part * Vec2(set.edges[i].x_mm, set.edges[i].y_mm);
    out += std::none_of(drawing.edges.begin(), drawing.edges.end(),
                        [&](const workpiece::VisibleEdge& e) { return distance(p, e.line) < 5; });
  }
  return out;
}

/// Where the beam crosses visible edges, frame Part, and which way the material lies.
std::vector<std::pair<Vec2, Vec2>> crossings_of(const workpiece::OutlineTemplate& outline, const EdgeSet& set,
                                                double end_margin_mm) {
  constexpr double kAcross = 0.35;  // what crosses more slantingly nobody can promise to see
  const Pose2 to_part = set.truth.inverse();
  std::vector<std::pair<Vec2, Vec2>> out;
  for (const PathPiece& piece : set.path) {
    const Vec2 from = to_part * Vec2(piece.x0_mm, piece.y0_mm), to = to_part * Vec2(piece.x1_mm, piece.y1_mm);
    for (const workpiece::VisibleEdge& e : outline.edges) {
      const double before = (from - e.line.a).dot(e.outward), after = (to - e.line.a).dot(e.outward);
      if ((before < 0) == (after < 0) || std::abs(after - before) < kAcross * (to - from).norm()) continue;
      const Vec2 at = from + before / (before - after) * (to - from);
      const double along = (at - e.line.a).dot(e.line.direction());
      if (along >= end_margin_mm && along <= e.line.length() - end_margin_mm) out.push_back({at, e.outward});
    }
  }
  return out;
}

/// Crossings of the drawing's edges that the scan should have had and that the part does not give.
int lost_crossings(const workpiece::OutlineTemplate& drawing, const workpiece::OutlineTemplate& part,
                   const EdgeSet& set) {
  const auto given = crossings_of(part, set, 0);
  const auto drawn = crossings_of(drawing, set, 3);
  return static_cast<int>(std::count_if(drawn.begin(), drawn.end(), [&](const auto& d) {
    return std::none_of(given.begin(), given.end(), [&](const auto& g) {
      return (g.first - d.first).norm() < 5 && g.second.dot(d.second) > 0;
    });
  }));
}

void report(Book& book, const std::string& name, const Counts& counts) {
  if (book.options.json) return;
  for (const auto& [cause, n] : counts.causes)
    std::fprintf(stderr, "    %s: %s %d\n", name.c_str(), cause.c_str(), n);
  for (const std::string& line : counts.wrong)
    std::fprintf(stderr, "    %s %s\n", name.c_str(), line.c_str());
}

/// These are their own mirror images, turned by 180 degrees at most.
bool own_mirror(const std::string& name) {
  return name == "rect" || name == "nearsym" || name == "aframe" || name == "fence" || name == "tubes";
}

void altered_parts(Book& book, const Kind& kind, const PartUnderTest& part, std::uint64_t seed) {
  const std::string name = std::string(to_string(kind.how)) + " " + part.workpiece.name;
  if (!book.wanted(name)) return;
  if (kind.how == Wrong::Mirrored && own_mirror(part.workpiece.name)) return;
  // Two members less one are a bar.
  if (kind.how == Wrong::Missing && part.workpiece.members.size() < 3) return;
  std::mt19937_64 random(seed);
  Counts counts;
  for (int i = 0; i < std::min(book.options.trials, 100); ++i) {
    const auto other = altered(part.workpiece, kind.how, random());
    if (!other) continue;
    const auto outline = workpiece::build_template(other->part);
    const std::uint64_t one = seed + static_cast<std::uint64_t>(i);
    const EdgeSet set = make_set(*outline, Setting{}, one);
    const int telling = telling_points(part.outline(), set);
    const int lost = lost_crossings(part.outline(), *outline, set);
    count(counts, part.localizer.localize(set.edges, set.path, options_for(Setting{})), kind.cause, one,
          other->what + ", " + std::to_string(telling) + " points off the drawing, " + std::to_string(lost) +
              " crossings lost",
          telling + lost > 0);
  }
  if (counts.trials == 0) return;
  report(book, name, counts);
  const double share = 100.0 * counts.accepted / counts.trials;
  // A bar that is longer at one end may end where no line of the scan passes.
  const bool judged = kind.how != Wrong::Lengthened;
  book.add(name + " accepted", share, "%", NAN, judged ? 0 : NAN, judged ? Better::Lower : Better::None);
  if (kind.cause != nullptr)
    book.add(name + " cause named right", 100.0 * counts.named / counts.trials, "%", NAN, 95, Better::Higher);
  if (kind.how != Wrong::Moved || counts.shown == 0) return;
  book.add(name + " cause named right, where the scan shows it", 100.0 * counts.shown_named / counts.shown,
           "%", NAN, 95, Better::Higher);
  book.add(name + " not shown by the scan", 100.0 * (counts.trials - counts.shown) / counts.trials, "%", NAN,
           NAN, Better::None);
}

/// The right part turned by 180 degrees, where the job allows 20: never accepted unless a true symmetry
/// makes the turn invisible.
void turned(Book& book, const PartUnderTest& part, std::uint64_t seed) {
  const std::string name = "turned 180 " + part.workpiece.name;
  const workpiece::OutlineTemplate& outline = part.outline();
  if (!book.wanted(name)) return;
  if (!outline.symmetries.empty() && outline.symmetries.front().gap_mm == 0) return;
  workpiece::OutlineTemplate around = outline;
  const auto turn = [&](const Vec2& p) -> Vec2 { return 2 * outline.centroid - p; };
  for (workpiece::VisibleEdge& e : around.edges) {
    e.line = {turn(e.line.a), turn(e.line.b)};
    e.outward = -e.outward;
  }
  for (Polygon& m : around.members) {
    for (Vec2& p : m) p = turn(p);
  }
  Counts counts;
  for (int i = 0; i < std::min(book.options.trials, 100); ++i) {
    const std::uint64_t one = seed + static_cast<std::uint64_t>(i);
    const EdgeSet set = make_set(around, Setting{}, one);
    count(counts, part.localizer.localize(set.edges, set.path, options_for(Setting{})), "out_of_range", one,
          "turned");
  }
  report(book, name, counts);
  const double share = 100.0 * counts.accepted / counts.trials;
  book.add(name + " accepted", share, "%", NAN, 0);
  book.add(name + " cause named right", 100.0 * counts.named / counts.trials, "%", NAN, 95, Better::Higher);
}

}  // namespace

void wrong_parts(Book& book) {
  for (const Kind& kind : kKinds) {
    book.each_part(
        [&](const PartUnderTest& part, std::uint64_t seed) { altered_parts(book, kind, part, seed); });
  }
  book.each_part([&](const PartUnderTest& part, std::uint64_t seed) { turned(book, part, seed); });
}

}  // namespace weldcell::bench
