#include "cad/solid.hpp"

#include <fmt/format.h>

#include <BRepAdaptor_Surface.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRep_Tool.hxx>
#include <Poly_Triangulation.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "cad/cad_part.hpp"
#include "cad/outline.hpp"

namespace weldcell::cad {

namespace {

constexpr double kDeflectionMm = 0.02;
constexpr double kDeflectionRad = 0.1;
constexpr std::size_t kMaxTriangles = 400'000;
constexpr double kSameHeightMm = 0.05;

struct Triangle {
  std::array<Eigen::Vector3d, 3> p;
  Eigen::Vector3d normal;  ///< unit, outward
};

struct MeshedFace {
  std::vector<Triangle> triangles;
  bool flat_up = false;       ///< a plane whose normal is +Z
  double tube_radius_mm = 0;  ///< of a cylinder with a level axis, else 0
  double top_mm = -1e30;
};

bool level_cylinder(const BRepAdaptor_Surface& surface) {
  return surface.GetType() == GeomAbs_Cylinder && std::abs(surface.Cylinder().Axis().Direction().Z()) < 1e-3;
}

std::vector<MeshedFace> meshed(const TopoDS_Shape& solid) {
  BRepMesh_IncrementalMesh(solid, kDeflectionMm, Standard_False, kDeflectionRad, Standard_False);
  std::vector<MeshedFace> faces;
  std::size_t total = 0;
  for (TopExp_Explorer at(solid, TopAbs_FACE); at.More(); at.Next()) {
    const TopoDS_Face& face = TopoDS::Face(at.Current());
    TopLoc_Location location;
    const Handle(Poly_Triangulation) mesh = BRep_Tool::Triangulation(face, location);
    if (mesh.IsNull()) continue;
    total += static_cast<std::size_t>(mesh->NbTriangles());
    if (total > kMaxTriangles) return {};
    MeshedFace out;
    const gp_Trsf placed = location.Transformation();
    const auto node = [&](int i) {
      const gp_Pnt p = mesh->Node(i).Transformed(placed);
      return Eigen::Vector3d(p.X(), p.Y(), p.Z());
    };
    for (int i = 1; i <= mesh->NbTriangles(); ++i) {
      int a = 0, b = 0, c = 0;
      mesh->Triangle(i).Get(a, b, c);
      if (face.Orientation() == TopAbs_REVERSED) std::swap(b, c);
      Triangle t{{node(a), node(b), node(c)}, {}};
      const Eigen::Vector3d n = (t.p[1] - t.p[0]).cross(t.p[2] - t.p[0]);
      if (n.norm() < 1e-12) continue;
      t.normal = n.normalized();
      for (const Eigen::Vector3d& p : t.p) out.top_mm = std::max(out.top_mm, p.z());
      out.triangles.push_back(t);
    }
    const BRepAdaptor_Surface surface(face);
    if (level_cylinder(surface)) out.tube_radius_mm = surface.Cylinder().Radius();
    out.flat_up =
        surface.GetType() == GeomAbs_Plane && !out.triangles.empty() && out.triangles[0].normal.z() > 0.9999;
    faces.push_back(std::move(out));
  }
  return faces;
}

/// Rim of the sheets that the triangles make, seen from above: edges that belong to one of them only.
template <typename Keep>
std::vector<Segment> rim(const std::vector<MeshedFace>& faces, Keep keep) {
  using Corner = std::array<long long, 3>;
  const auto corner = [](const Eigen::Vector3d& p) {
    return Corner{std::llround(p.x() * 1e3), std::llround(p.y() * 1e3), std::llround(p.z() * 1e3)};
  };
  std::map<std::pair<Corner, Corner>, std::pair<int, Segment>> edges;
  for (const MeshedFace& face : faces) {
    for (const Triangle& t : face.triangles) {
      if (!keep(face, t)) continue;
      for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d &a = t.p[i], &b = t.p[(i + 1) % 3];
        const Corner ca = corner(a), cb = corner(b);
        auto& entry = edges[{std::min(ca, cb), std::max(ca, cb)}];
        ++entry.first;
        entry.second = {a.head<2>(), b.head<2>()};
      }
    }
  }
  std::vector<Segment> out;
  for (const auto& [key, entry] : edges) {
    if (entry.first == 1) out.push_back(entry.second);
  }
  return out;
}

double nearest(const Vec2& p, const std::vector<Segment>& rim_of_flat) {
  double best = 1e30;
  for (const Segment& s : rim_of_flat) best = std::min(best, distance(p, s));
  return best;
}

/// Distance from the silhouette's long sides to the flat top, checked against a round edge that explains it.
Result<double> edge_radius(const Polygon& silhouette, const std::vector<Segment>& flat_rim,
                           const std::vector<MeshedFace>& faces, double top_mm, const std::string& name) {
  double least = 1e30, most = 0;
  for (const std::size_t i : long_sides(silhouette)) {
    const Vec2 middle = (silhouette[i] + silhouette[(i + 1) % silhouette.size()]) / 2;
    const double d = nearest(middle, flat_rim);
    least = std::min(least, d);
    most = std::max(most, d);
  }
  if (most < kSameHeightMm) return 0.0;
  for (const MeshedFace& face : faces) {
    const double r = face.tube_radius_mm;
    if (r <= 0 || face.top_mm < top_mm - kSameHeightMm) continue;
    if (std::abs(most - r) < 0.05 + 0.02 * r && (least > r * 0.9 || least < kSameHeightMm)) return r;
  }
  if (most - least < 0.1 && most <= 10) return std::round(most * 1000) / 1000;
  return fault("cad.top",
               fmt::format("'{}' reaches {:.2f} mm beyond its flat top, with no round edge that explains it",
                           name, most),
               "weldcell needs members whose top is flat over their whole width");
}

/// Holes in the flat top: rims that run clockwise, for triangles run counter-clockwise seen from outside.
int count_openings(const std::vector<Segment>& flat_rim) {
  std::map<int, int> parent;
  PointPool pool;
  const auto root = [&](int id) {
    while (parent[id] != id) id = parent[id];
    return id;
  };
  for (const Segment& s : flat_rim) {
    const int a = pool.id(s.a), b = pool.id(s.b);
    parent.try_emplace(a, a);
    parent.try_emplace(b, b);
    parent[root(a)] = root(b);
  }
  std::map<int, double> area_mm2;
  for (const Segment& s : flat_rim) {
    area_mm2[root(pool.id(s.a))] += (s.a.x() * s.b.y() - s.a.y() * s.b.x()) / 2;
  }
  return static_cast<int>(
      std::count_if(area_mm2.begin(), area_mm2.end(), [](const auto& loop) { return loop.second < -1; }));
}

}  // namespace

Result<SolidFromAbove> seen_from_above(const TopoDS_Shape& solid, const std::string& name) {
  const std::vector<MeshedFace> faces = meshed(solid);
  SolidFromAbove out;
  out.bottom_mm = 1e30;
  out.top_mm = -1e30;
  for (const MeshedFace& face : faces) {
    for (const Triangle& t : face.triangles) {
      for (const Eigen::Vector3d& p : t.p) {
        out.bottom_mm = std::min(out.bottom_mm, p.z());
        out.top_mm = std::max(out.top_mm, p.z());
      }
    }
  }
  if (out.top_mm < out.bottom_mm) {
    return fault("cad.limit", fmt::format("'{}' cannot be meshed within {} triangles", name, kMaxTriangles),
                 "simplify the model or export only the frame's members");
  }
  const auto on_top = [&](const MeshedFace& face, const Triangle&) {
    return face.flat_up && face.top_mm > out.top_mm - kSameHeightMm;
  };
  const std::vector<Segment> flat_rim = rim(faces, on_top);
  if (flat_rim.empty()) {
    return fault("cad.top",
                 fmt::format("'{}' is a part without a flat top: no level plane at its highest point", name),
                 "weldcell scans flat tops; is the right plane on the table? try --plane xz or --plane yz");
  }
  const std::vector<Segment> seen =
      rim(faces, [](const MeshedFace&, const Triangle& t) { return t.normal.z() > 1e-3; });
  if (seen.size() > 6000) {
    return fault("cad.limit", fmt::format("'{}' has {} pieces of rim", name, seen.size()),
                 "simplify the model");
  }
  auto boundary = outer_boundary(seen);
  for (const double coarser_mm : {2e-3, 2e-2}) {
    if (!boundary) boundary = outer_boundary(seen, coarser_mm);
  }
  if (!boundary) {
    return fault("cad.silhouette", fmt::format("the silhouette of '{}' does not close", name),
                 "heal the solid in the CAD system and export it again");
  }
  out.silhouette = straightened(*boundary);
  if (out.silhouette.size() > kMaxVertices) {
    return fault("cad.limit", fmt::format("the outline of '{}' has {} vertices", name, out.silhouette.size()),
                 fmt::format("at most {}; simplify the model", kMaxVertices));
  }
  auto radius = edge_radius(out.silhouette, flat_rim, faces, out.top_mm, name);
  if (!radius.ok()) return radius.error();
  out.edge_radius_mm = *radius;
  out.openings = count_openings(flat_rim);
  return out;
}

}  // namespace weldcell::cad
