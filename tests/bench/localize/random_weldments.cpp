// Weldments drawn at random, a new one for every trial, so that no threshold can have been chosen for any.
#include <algorithm>
#include <random>

#include "book.hpp"
#include "weldcell/base/units.hpp"
#include "weldments.hpp"

namespace weldcell::bench {

namespace {

using localize::Localization;
using localize::Verdict;
using workpiece::Member;
using workpiece::Workpiece;

/// Mirror images closer than this to the part itself are the same part to a worker.
constexpr double kOwnMirror_mm = 15;
constexpr double kTellable_mm = 2;

/// A frame of two rails with stiles, posts, cross bars and braces between them, or a part of it: all bars
/// square to each other but for braces, joints flush.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed) {}

  Workpiece weldment() {
    length_ = uniform(500, 1300), height_ = uniform(350, 800), rail_ = width();
    switch (random_() % 5) {
      case 0:
        open_frame();
        break;
      case 1:
        braced_frame();
        break;
      default:
        frame();
    }
    Workpiece w;
    w.name = "random";
    w.height_mm = 40;
    // The drawing's origin where somebody put it.
    const Vec2 shift(uniform(-60, 60), uniform(-60, 60));
    for (Member& m : members_) {
      for (Vec2& p : m.outline) p += shift;
    }
    w.members = std::move(members_);
    return *workpiece::validated(std::move(w));
  }

 private:
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() % 10'000) / 9'999;
  }
  double width() { return 40 + 10 * static_cast<double>(random_() % 4); }
  void add(const Vec2& from, const Vec2& to, double width_mm) {
    members_.push_back(bar("m" + std::to_string(members_.size()), from, to, width_mm));
  }
  /// Half the room between the rails, and its middle line's ends.
  double inner() const { return height_ / 2 - rail_; }

  void rails() {
    const double y = (height_ - rail_) / 2;
    add({-length_ / 2, -y}, {length_ / 2, -y}, rail_);
    add({-length_ / 2, y}, {length_ / 2, y}, rail_);
  }
  /// Uprights between the rails at least 130 mm apart.
  std::vector<double> uprights(std::size_t most, double from, double to) {
    std::vector<double> at;
    for (int tries = 0; tries < 40 && at.size() < most; ++tries) {
      const double x = uniform(from, to);
      if (std::all_of(at.begin(), at.end(), [&](double other) { return std::abs(other - x) > 130; }))
        at.push_back(x);
    }
    std::sort(at.begin(), at.end());
    for (const double x : at) add({x, -inner()}, {x, inner()}, post_);
    return at;
  }

  void frame() {
    rails();
    post_ = width();
    const double end = length_ / 2 - post_ / 2;
    add({-end, -inner()}, {-end, inner()}, post_);
    add({end, -inner()}, {end, inner()}, post_);
    const std::vector<double> at = uprights(random_() % 4, -end + 130, end - 130);
    if (at.empty() || random_() % 2 == 0) return;
    const double y = uniform(-0.5, 0.5) * inner();
    add({-end + post_ / 2, y}, {at.front() - post_ / 2, y}, width());
  }

  /// Two rails and posts, ends open, one rail longer than the other.
  void open_frame() {
    const double y = (height_ - rail_) / 2;
    add({-length_ / 2, -y}, {length_ / 2, -y}, rail_);
    add({-length_ / 2 + uniform(40, 150), y}, {length_ / 2 - uniform(40, 150), y}, rail_);
    post_ = width();
    uprights(2 + random_() % 3, -length_ / 2 + 190, length_ / 2 - 190);
  }

  void braced_frame() {
    rails();
    post_ = width();
    const double end = length_ / 2 - post_ / 2, left = -length_ / 2 + post_, right = length_ / 2 - post_;
    add({-end, -inner()}, {-end, inner()}, post_);
    add({end, -inner()}, {end, inner()}, post_);
    const double foot = uniform(left, 0.5 * left), head = uniform(0.2 * right, right - 80),
                 wide = width() * 1.3;
    Member brace;
    brace.name = brace.tag = "brace";
    brace.outline = {{foot, -inner()}, {foot + wide, -inner()}, {head + wide, inner()}, {head, inner()}};
    members_.push_back(brace);
  }

  std::mt19937_64 random_;
  double length_ = 0, height_ = 0, rail_ = 0, post_ = 0;
  std::vector<Member> members_;
};

/// Nearly symmetric beyond what a scan tells apart, and not quite: which way it lies has no answer.
bool undecidable(const workpiece::OutlineTemplate& outline) {
  return std::any_of(outline.symmetries.begin(), outline.symmetries.end(),
                     [](const workpiece::Symmetry& s) { return s.gap_mm > 0 && s.gap_mm < kTellable_mm; });
}

PartUnderTest drawn(std::uint64_t seed) {
  for (;; seed += 1'000'000) {
    PartUnderTest part = part_under_test(Draw(seed).weldment());
    if (!undecidable(part.outline())) return part;
  }
}

/// Whether a mirror image turned by a multiple of a quarter turn lies on the part.
bool own_mirror(const workpiece::OutlineTemplate& outline) {
  for (int quarter = 0; quarter < 4; ++quarter) {
    const Pose2 turn{0, 0, quarter * kPi / 2};
    double worst = 0;
    for (const Polygon& member : outline.members) {
      for (const Vec2& p : member) {
        const Vec2 image = turn.rotate(Vec2(-(p.x() - outline.centroid.x()), p.y() - outline.centroid.y())) +
                           outline.centroid;
        double nearest = 1e9;
        for (const Polygon& other : outline.members) {
          for (std::size_t k = 0; k < other.size(); ++k)
            nearest = std::min(nearest, distance(image, Segment{other[k], other[(k + 1) % other.size()]}));
        }
        worst = std::max(worst, nearest);
      }
    }
    if (worst < kOwnMirror_mm) return true;
  }
  return false;
}

struct Group {
  const char* name;
  Setting setting;
  bool basin_only = false;  ///< too few points for a verdict to be asked of
};

std::vector<Group> groups() {
  Setting base, out10, out30, missing, wide, extreme, hard, zigzag, spiral, var05, var1;
  out10.outliers = 0.1, out10.strays_on_path = true;
  out30.outliers = 0.3, out30.strays_on_path = true;
  wide.shift_mm = 50;
  extreme.shift_mm = 100, extreme.turn_deg = 180, extreme.outliers = 0.1;
  hard.sigma_mm = 0.4, hard.outliers = 0.3, hard.pitch_mm = 100, hard.drop_out = 0.2,
  hard.members_missing = 1;
  hard.member_mm = 0.5, hard.member_deg = 0.125, hard.shift_mm = 50;
  zigzag.latency_s = spiral.latency_s = 0.008, spiral.spiral = true;
  var05.member_mm = 0.5, var05.member_deg = 0.125;
  var1.member_mm = 1, var1.member_deg = 0.25;
  return {{"base", base},          {"out10 on the path", out10}, {"out30 on the path", out30},
          {"wide", wide},          {"extreme", extreme},         {"hard", hard, true},
          {"zigzag 8 ms", zigzag}, {"spiral 8 ms", spiral},      {"var05", var05},
          {"var1", var1}};
}

void good_parts(Book& book, const Group& group) {
  const std::string name = std::string("random ") + group.name;
  if (!book.wanted(name)) return;
  Tally t;
  for (int i = 0; i < book.options.trials; ++i) {
    const std::uint64_t one = book.options.seed + static_cast<std::uint64_t>(i);
    const PartUnderTest part = drawn(one);
    if (group.setting.members_missing > 0 && part.workpiece.members.size() < 4) continue;
    const EdgeSet set = make_set(part.outline(), group.setting, one);
    const Localization found = part.localizer.localize(set.edges, set.path, options_for(group.setting));
    judge(part.outline(), group.setting, set, found, t, "seed " + std::to_string(one));
  }
  book.explain(name, t);
  if (group.basin_only) {
    book.add(name + " basin", t.share(t.basin), "%", NAN, 99.5, Better::Higher);
    book.add(name + " false accept", t.share(t.false_accept), "%", NAN, 0.1);
    return;
  }
  const bool var1 = group.setting.member_mm >= 1;
  if (!var1) book.add(name + " success", t.share(t.success), "%", NAN, 99.5, Better::Higher);
  book.add(name + " RMS/bound", t.ratio(), "1", 1, group.setting.latency_s > 0 ? NAN : 1.1, Better::Lower,
           t.ratio_error());
  book.add(name + " NEES", t.mean_nees(), "1", 1, 1.5, Better::Lower, t.nees_error());
  book.add(name + " false accept", t.share(t.false_accept), "%", NAN, var1 ? 1 : 0.1);
  book.add(name + " false reject", t.share(t.false_reject), "%", NAN, var1 ? NAN : 5);
  book.add(name + " asked for another scan", t.share(t.again), "%", NAN, NAN, Better::None);
  if (group.setting.latency_s > 0)
    book.add(name + " latency error", 1e3 * std::sqrt(t.latency_square / t.judged), "ms", NAN,
             group.setting.spiral ? NAN : 0.2);
}

void wrong_parts(Book& book, Wrong how, const char* cause) {
  const std::string name = std::string("random ") + to_string(how);
  if (!book.wanted(name)) return;
  int trials = 0, accepted = 0, named = 0;
  for (int i = 0; i < book.options.trials; ++i) {
    const std::uint64_t one = book.options.seed + static_cast<std::uint64_t>(i);
    const PartUnderTest part = drawn(one);
    if (how == Wrong::Mirrored && own_mirror(part.outline())) continue;
    const auto other = altered(part.workpiece, how, std::mt19937_64(one)());
    if (!other) continue;
    const auto outline = workpiece::build_template(other->part);
    const EdgeSet set = make_set(*outline, Setting{}, one);
    const Localization found = part.localizer.localize(set.edges, set.path, options_for(Setting{}));
    ++trials;
    const bool wrong = found.verdict == Verdict::Weld, right_cause = found.cause == cause;
    accepted += wrong, named += right_cause;
    if ((wrong || !right_cause) && !book.options.json)
      std::fprintf(stderr, "    %s: %s%s, %s, seed %llu\n", name.c_str(), wrong ? "accepted, " : "",
                   found.cause.c_str(), other->what.c_str(), static_cast<unsigned long long>(one));
  }
  if (trials == 0) return;
  book.add(name + " accepted", 100.0 * accepted / trials, "%", NAN, 0);
  book.add(name + " cause named right", 100.0 * named / trials, "%", NAN, 95, Better::Higher);
}

}  // namespace

void random_weldments(Book& book) {
  for (const Group& group : groups()) good_parts(book, group);
  wrong_parts(book, Wrong::Mirrored, "mirrored");
  wrong_parts(book, Wrong::Missing, "member_missing");
  wrong_parts(book, Wrong::Moved, "wrong_revision");
}

}  // namespace weldcell::bench
