#include "weldcell/workpiece/workpiece.hpp"

#include <algorithm>
#include <cmath>
#include <set>

namespace weldcell::workpiece {

namespace {

constexpr double kSameVertex_mm = 1e-6;
constexpr double kMinArea_mm2 = 1.0;

Error fault(const std::string& code, const std::string& where, const std::string& what,
            const std::string& mend) {
  return Error{"workpiece." + code, where, what, mend};
}

double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }

bool segments_touch(const Segment& s, const Segment& t) {
  const Vec2 u = s.b - s.a, v = t.b - t.a;
  const double o1 = cross(u, t.a - s.a), o2 = cross(u, t.b - s.a);
  const double o3 = cross(v, s.a - t.a), o4 = cross(v, s.b - t.a);
  if (((o1 > 0) != (o2 > 0)) && ((o3 > 0) != (o4 > 0)) && o1 != 0 && o2 != 0 && o3 != 0 && o4 != 0)
    return true;
  return distance(t.a, s) < kSameVertex_mm || distance(t.b, s) < kSameVertex_mm ||
         distance(s.a, t) < kSameVertex_mm || distance(s.b, t) < kSameVertex_mm;
}

bool crosses_itself(const Polygon& polygon) {
  const std::size_t n = polygon.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Segment s{polygon[i], polygon[(i + 1) % n]};
    for (std::size_t j = i + 1; j < n; ++j) {
      const bool neighbours = j == i + 1 || (i == 0 && j == n - 1);
      if (!neighbours && segments_touch(s, Segment{polygon[j], polygon[(j + 1) % n]})) return true;
    }
  }
  return false;
}

/// Without vertices that repeat their predecessor; a closing vertex equal to the first is one of them.
Polygon without_repeats(const Polygon& polygon) {
  Polygon out;
  for (const Vec2& p : polygon) {
    if (out.empty() || (p - out.back()).norm() > kSameVertex_mm) out.push_back(p);
  }
  while (out.size() > 1 && (out.front() - out.back()).norm() <= kSameVertex_mm) out.pop_back();
  return out;
}

Status check_outline(Member& member, const std::string& where) {
  for (const Vec2& p : member.outline) {
    if (!p.allFinite())
      return fault("outline", where + ": outline", "a coordinate is not a number", "correct it");
  }
  member.outline = without_repeats(member.outline);
  if (member.outline.size() < 3) {
    return fault("outline", where + ": outline",
                 std::to_string(member.outline.size()) + " distinct vertices, at least 3 are needed",
                 "give the closed silhouette seen from above");
  }
  const double area = signed_area(member.outline);
  if (std::abs(area) <= kMinArea_mm2) {
    return fault("area", where + ": outline", "encloses only " + std::to_string(std::abs(area)) + " mm2",
                 "check the units and the order of the vertices");
  }
  if (crosses_itself(member.outline)) {
    return fault("outline", where + ": outline", "crosses itself", "order the vertices along the silhouette");
  }
  if (area < 0) std::reverse(member.outline.begin(), member.outline.end());
  return Done{};
}

Status check_weld(const Weld& weld, const std::set<std::string>& names, const std::string& where) {
  for (const std::string& name : weld.joins) {
    if (!names.count(name)) {
      return fault("joins", where + ": joins", "no member is called '" + name + "'",
                   "name the members that it joins");
    }
  }
  if (weld.pieces.empty())
    return fault("path", where + ": path", "has fewer than 2 points", "give start and end");
  bool finite = weld.start.allFinite();
  for (const SeamPiece& piece : weld.pieces) finite = finite && piece.to.allFinite() && piece.via.allFinite();
  if (!finite) return fault("path", where + ": path", "a coordinate is not a number", "correct it");
  if (!(weld.tolerance_mm > 0) || !std::isfinite(weld.tolerance_mm)) {
    return fault("tolerance", where + ": tolerance_mm", "is not above 0",
                 "state the lateral tolerance in mm");
  }
  return Done{};
}

}  // namespace

Result<Workpiece> validated(Workpiece workpiece) {
  const std::string where = workpiece.name;
  if (workpiece.name.empty()) return fault("name", "workpiece", "has no name", "give it one");
  if (!(workpiece.height_mm > 0) || !std::isfinite(workpiece.height_mm)) {
    return fault("height", where + ": height_mm", "is not above 0",
                 "state the height of the top surface above the table");
  }
  if (workpiece.members.empty())
    return fault("members", where + ": members", "is empty", "list at least one member");
  std::set<std::string> names;
  for (Member& member : workpiece.members) {
    const std::string place = where + ": member " + member.name;
    if (member.name.empty()) return fault("name", where + ": members", "a member has no name", "give it one");
    if (!names.insert(member.name).second) return fault("name", place, "stands twice", "rename one of them");
    if (!(member.edge_radius_mm >= 0) || !std::isfinite(member.edge_radius_mm)) {
      return fault("radius", place + ": edge_radius_mm", "is negative", "use 0 for a sharp edge");
    }
    if (const Status status = check_outline(member, place); !status.ok()) return status.error();
  }
  for (const Fixture& fixture : workpiece.fixtures) {
    if (!names.count(fixture.member)) {
      return fault("fixture", where + ": fixtures", "no member is called '" + fixture.member + "'",
                   "name the member");
    }
    if (!(fixture.diameter_mm > 0) || !std::isfinite(fixture.x_mm + fixture.y_mm + fixture.diameter_mm)) {
      return fault("fixture", where + ": fixtures", "a fixture's place or diameter is no length",
                   "correct it");
    }
  }
  std::set<std::string> weld_names;
  for (const Weld& weld : workpiece.welds) {
    const std::string place = where + ": weld " + weld.name;
    if (weld.name.empty()) return fault("name", where + ": welds", "a weld has no name", "give it one");
    if (!weld_names.insert(weld.name).second)
      return fault("name", place, "stands twice", "rename one of them");
    if (const Status status = check_weld(weld, names, place); !status.ok()) return status.error();
  }
  return workpiece;
}

}  // namespace weldcell::workpiece
