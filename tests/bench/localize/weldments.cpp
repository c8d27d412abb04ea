#include "weldments.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "weldcell/base/units.hpp"

namespace weldcell::bench {

using workpiece::Member;
using workpiece::Workpiece;

namespace {

/// A quadrilateral from its corners' coordinates.
Member quad(const std::string& name, const std::array<double, 8>& xy) {
  Member out;
  out.name = out.tag = name;
  for (std::size_t i = 0; i < 8; i += 2) out.outline.emplace_back(xy[i], xy[i + 1]);
  return out;
}

Workpiece weldment(const std::string& name, std::vector<Member> members) {
  Workpiece w;
  w.name = name;
  w.height_mm = 40;
  w.members = std::move(members);
  return *workpiece::validated(std::move(w));
}

Workpiece ladder() {
  std::vector<Member> m{bar("m0", {-492, -225}, {508, -225}, 50), bar("m1", {-492, 225}, {508, 225}, 50)};
  int i = 2;
  for (const double x : {-467.0, -162.0, 108.0, 483.0})
    m.push_back(bar("m" + std::to_string(i++), {x, -200}, {x, 200}, 50));
  return weldment("ladder", m);
}

Workpiece rect() {
  return weldment("rect", {bar("m0", {-400, -230}, {400, -230}, 40), bar("m1", {-400, 230}, {400, 230}, 40),
                           bar("m2", {-380, -210}, {-380, 210}, 40), bar("m3", {380, -210}, {380, 210}, 40)});
}

Workpiece nearsym() {
  return weldment("nearsym",
                  {bar("m0", {-300, -280}, {300, -280}, 40), bar("m1", {-300, 280}, {300, 280}, 40),
                   bar("m2", {-280, -260}, {-280, 260}, 40), bar("m3", {280, -260}, {280, 260}, 40),
                   bar("m4", {3, -260}, {3, 260}, 40)});
}

Workpiece mitre() {
  return weldment("mitre", {quad("m0", {-350, -250, 350, -250, 300, -200, -300, -200}),
                            quad("m1", {350, -250, 350, 250, 300, 200, 300, -200}),
                            quad("m2", {350, 250, -350, 250, -300, 200, 300, 200}),
                            quad("m3", {-350, 250, -350, -250, -300, -200, -300, 200}),
                            quad("m4", {40, -200, 90, -200, 90, 200, 40, 200})});
}

Workpiece aframe() {
  return weldment("aframe",
                  {bar("m0", {-400, -260}, {400, -260}, 60), bar("m1", {-330, -230}, {-30, 300}, 50),
                   bar("m2", {330, -230}, {30, 300}, 50), bar("m3", {-190, 0}, {190, 0}, 40)});
}

/// Three members only: little redundancy when parts are off.
Workpiece corner() {
  return weldment("corner",
                  {bar("m0", {-350, -250}, {350, -250}, 50), bar("m1", {-325, -225}, {-325, 300}, 50),
                   bar("m2", {120, -225}, {120, 150}, 50)});
}

Workpiece gate() {
  return weldment(
      "gate", {bar("sill", {-600, -380}, {600, -380}, 45), bar("head", {-600, 380}, {600, 380}, 45),
               bar("hinge", {-577.5, -357.5}, {-577.5, 357.5}, 45),
               bar("lock", {577.5, -357.5}, {577.5, 357.5}, 45), bar("post", {140, -357.5}, {140, 357.5}, 45),
               quad("brace", {-555, -357.5, -505, -357.5, 117.5, 357.5, 67.5, 357.5})});
}

Workpiece trapezoid() {
  return weldment("trapezoid", {quad("base", {-450, -240, 450, -240, 420, -190, -420, -190}),
                                quad("top", {-270, 240, 270, 240, 245, 190, -245, 190}),
                                quad("left", {-450, -240, -420, -190, -245, 190, -270, 240}),
                                quad("right", {450, -240, 420, -190, 245, 190, 270, 240}),
                                bar("post", {-85, -190}, {-85, 190}, 40)});
}

Workpiece tee() {
  return weldment("tee", {bar("beam", {-700, 0}, {700, 0}, 60), bar("stem", {-180, 30}, {-180, 480}, 60)});
}

Workpiece ell() {
  return weldment("ell",
                  {bar("long", {-500, -200}, {500, -200}, 50), bar("short", {-475, -175}, {-475, 225}, 50)});
}

Workpiece grid() {
  std::vector<Member> m{bar("south", {-550, -330}, {550, -330}, 40),
                        bar("north", {-550, 330}, {550, 330}, 40)};
  const std::array<double, 4> columns{-530, -170, 150, 530};
  for (std::size_t i = 0; i < columns.size(); ++i)
    m.push_back(bar("column_" + std::to_string(i + 1), {columns[i], -310}, {columns[i], 310}, 40));
  const std::array<std::array<double, 2>, 3> rows{{{-120, 100}, {-60, 140}, {-150, 40}}};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t k = 0; k < 2; ++k) {
      m.push_back(bar("row_" + std::to_string(2 * i + k + 1), {columns[i] + 20, rows[i][k]},
                      {columns[i + 1] - 20, rows[i][k]}, 30));
    }
  }
  return weldment("grid", m);
}

Workpiece triangle() {
  return weldment("triangle", {bar("floor", {-430, -230}, {430, -230}, 50),
                               quad("back", {-405, -205, -350, -205, 76, 330, 30, 360}),
                               quad("front", {405, -205, 350, -205, 76, 330, 110, 350})});
}

Workpiece fence() {
  std::vector<Member> m{bar("low", {-460, -210}, {460, -210}, 40), bar("high", {-460, 210}, {460, 210}, 40)};
  for (int i = 0; i < 7; ++i) {
    const double x = -390 + 120 * i;
    m.push_back(bar("picket_" + std::to_string(i + 1), {x, -190}, {x, 190}, 30));
  }
  return weldment("fence", m);
}

/// A seam of 40 mm along x, on top of the part.
workpiece::Weld seam(const std::string& name, const std::vector<std::string>& joins, const Vec2& middle) {
  workpiece::Weld out;
  out.name = name;
  out.joins = joins;
  out.start = {middle.x() - 20, middle.y(), 40};
  workpiece::SeamPiece piece;
  piece.to = {middle.x() + 20, middle.y(), 40};
  out.pieces.push_back(piece);
  return out;
}

/// The tubes of the sample workpiece: 40 x 40 with round edges, nearly symmetric by 180 degrees.
Workpiece tubes() {
  std::vector<Member> m{bar("rail_L", {0, 20}, {1200, 20}, 40), bar("rail_R", {0, 580}, {1200, 580}, 40)};
  int i = 1;
  for (const double x : {20.0, 400.0, 780.0, 1180.0})
    m.push_back(bar("rung_" + std::to_string(i++), {x, 40}, {x, 560}, 40));
  for (Member& member : m) member.edge_radius_mm = 4;
  Workpiece w = weldment("tubes", m);
  for (std::size_t r = 2; r < m.size(); ++r) {
    const double x = centroid(m[r].outline).x();
    w.welds.push_back(seam("L" + std::to_string(static_cast<int>(x)), {"rail_L", m[r].name}, {x, 40}));
    w.welds.push_back(seam("R" + std::to_string(static_cast<int>(x)), {"rail_R", m[r].name}, {x, 560}));
  }
  return *workpiece::validated(std::move(w));
}

bool unlike(const Member& a, const Member& b) {
  const Vec2 ca = centroid(a.outline), cb = centroid(b.outline);
  return std::none_of(a.outline.begin(), a.outline.end(), [&](const Vec2& p) {
    return std::any_of(b.outline.begin(), b.outline.end(),
                       [&](const Vec2& q) { return (p - ca - (q - cb)).norm() < 10; });
  });
}

/// Two members turned about their own centroids into each other's place and direction.
std::string swap_two(Workpiece& part, std::uint64_t pick) {
  std::vector<std::array<std::size_t, 2>> pairs;
  for (std::size_t a = 0; a < part.members.size(); ++a) {
    for (std::size_t b = a + 1; b < part.members.size(); ++b) {
      if (unlike(part.members[a], part.members[b])) pairs.push_back({a, b});
    }
  }
  if (pairs.empty()) return "";
  const auto [a, b] = pairs[pick % pairs.size()];
  const Vec2 from = centroid(part.members[a].outline), to = centroid(part.members[b].outline);
  for (Vec2& p : part.members[a].outline) p += to - from;
  for (Vec2& p : part.members[b].outline) p += from - to;
  return part.members[a].name + " and " + part.members[b].name + " in each other\'s place";
}

/// The two vertices at one end of a member's longest direction move out by 20 mm.
void lengthen(Member& member, bool far_end) {
  Vec2 axis = Vec2::UnitX();
  double longest = 0;
  for (std::size_t i = 0; i < member.outline.size(); ++i) {
    const Vec2 side = member.outline[(i + 1) % member.outline.size()] - member.outline[i];
    if (side.norm() > longest) longest = side.norm(), axis = side.normalized();
  }
  if (!far_end) axis = -axis;
  std::vector<Vec2*> vertices;
  for (Vec2& p : member.outline) vertices.push_back(&p);
  std::sort(vertices.begin(), vertices.end(),
            [&](const Vec2* p, const Vec2* q) { return p->dot(axis) > q->dot(axis); });
  for (std::size_t i = 0; i < 2; ++i) *vertices[i] += 20 * axis;
}

}  // namespace

Member bar(const std::string& name, const Vec2& from, const Vec2& to, double width_mm) {
  const Vec2 d = (to - from).normalized(), n = 0.5 * width_mm * Vec2(-d.y(), d.x());
  Member out;
  out.name = out.tag = name;
  for (const Vec2& p : std::array<Vec2, 4>{from - n, to - n, to + n, from + n}) out.outline.push_back(p);
  return out;
}

std::vector<Workpiece> known_weldments() {
  return {ladder(), rect(), nearsym(), mitre(), aframe(), corner()};
}

std::vector<Workpiece> unseen_weldments() {
  return {gate(), trapezoid(), tee(), ell(), grid(), triangle(), fence(), tubes()};
}

Workpiece comb(int rungs) {
  std::vector<Member> m{bar("r0", {-900, -200}, {900, -200}, 12), bar("r1", {-900, 200}, {900, 200}, 12)};
  for (int i = 0; i < rungs; ++i) {
    const double x = -880 + 1760 * (i + 0.5 + 0.3 * std::sin(12.9898 * i)) / rungs;
    m.push_back(bar("g" + std::to_string(i), {x, -194}, {x, 194}, std::min(12.0, 700.0 / rungs)));
  }
  return weldment("comb" + std::to_string(rungs + 2), m);
}

const char* to_string(Wrong how) {
  switch (how) {
    case Wrong::Mirrored:
      return "mirrored";
    case Wrong::Moved:
      return "moved";
    case Wrong::Missing:
      return "missing";
    case Wrong::Swapped:
      return "swapped";
    case Wrong::Lengthened:
      return "lengthened";
  }
  return "";
}

std::optional<Altered> altered(const Workpiece& drawing, Wrong how, std::uint64_t pick) {
  Workpiece part = drawing;
  const std::size_t m = pick % part.members.size();
  const bool positive = (pick >> 16) % 2 == 0, sideways = (pick >> 17) % 2 == 0;
  std::string what = "mirrored";
  switch (how) {
    case Wrong::Mirrored:
      for (Member& member : part.members) {
        for (Vec2& p : member.outline) p.x() = -p.x();
      }
      break;
    case Wrong::Moved: {
      const double step = positive ? 20 : -20;
      for (Vec2& p : part.members[m].outline) p += sideways ? Vec2(step, 0) : Vec2(0, step);
      what = drawing.members[m].name + (positive ? " moved by 20 mm in " : " moved by -20 mm in ") +
             (sideways ? "x" : "y");
      break;
    }
    case Wrong::Missing:
      part.members.erase(part.members.begin() + static_cast<std::ptrdiff_t>(m));
      what = drawing.members[m].name + " missing";
      break;
    case Wrong::Swapped:
      what = swap_two(part, pick);
      if (what.empty()) return std::nullopt;
      break;
    case Wrong::Lengthened:
      lengthen(part.members[m], positive);
      what = drawing.members[m].name + " longer by 20 mm";
      break;
  }
  // A weld of a member that is not there has nothing to join.
  part.welds.clear();
  auto checked = workpiece::validated(std::move(part));
  if (!checked.ok()) return std::nullopt;
  return Altered{*std::move(checked), what};
}

}  // namespace weldcell::bench
