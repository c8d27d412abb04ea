#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "weldcell/base/units.hpp"
#include "weldcell/workpiece/workpiece.hpp"

namespace weldcell::workpiece {

namespace {

using Eigen::Vector3d;

/// The circle through three points, walked from `start` over `via` to `to`.
struct Arc {
  Vector3d centre, u, v;  ///< start = centre + u; v = u turned by 90 degrees towards the travel
  double sweep_rad = 0;
  double length_mm() const { return u.norm() * sweep_rad; }
  Vector3d at(double share) const {
    const double angle = share * sweep_rad;
    return centre + std::cos(angle) * u + std::sin(angle) * v;
  }
};

/// Circumcentre in barycentric form; nothing when the three points lie on a line.
std::optional<Arc> arc_through(const Vector3d& start, const Vector3d& via, const Vector3d& to) {
  const Vector3d a = via - start, b = to - start;
  const Vector3d normal = a.cross(b);
  if (normal.norm() <= 1e-9 * std::max(1.0, a.norm() * b.norm())) return std::nullopt;
  const Vector3d to_centre =
      (b.squaredNorm() * normal.cross(a) + a.squaredNorm() * b.cross(normal)) / (2 * normal.squaredNorm());
  Arc arc;
  arc.centre = start + to_centre;
  arc.u = -to_centre;
  arc.v = normal.normalized().cross(arc.u);
  const Vector3d end = to - arc.centre;
  double sweep = std::atan2(end.dot(arc.v), end.dot(arc.u));
  // The normal is that of start -> via -> to, so the travel is counter-clockwise about it.
  if (sweep <= 0) sweep += 2 * kPi;
  arc.sweep_rad = sweep;
  return arc;
}

int pieces_for(double length_mm, double step_mm) {
  return std::max(1, static_cast<int>(std::ceil(length_mm / step_mm - 1e-9)));
}

void append_line(std::vector<Vector3d>& out, const Vector3d& from, const Vector3d& to, double step_mm) {
  const int count = pieces_for((to - from).norm(), step_mm);
  for (int i = 1; i < count; ++i) out.push_back(from + (to - from) * (static_cast<double>(i) / count));
  out.push_back(to);
}

}  // namespace

std::vector<Vector3d> sample_path(const Weld& weld, double step_mm) {
  WELDCELL_ASSERT(step_mm > 0);
  std::vector<Vector3d> out{weld.start};
  for (const SeamPiece& piece : weld.pieces) {
    const Vector3d from = out.back();
    const std::optional<Arc> arc = piece.arc ? arc_through(from, piece.via, piece.to) : std::nullopt;
    if (!arc) {
      append_line(out, from, piece.to, step_mm);
      continue;
    }
    const int count = pieces_for(arc->length_mm(), step_mm);
    for (int i = 1; i < count; ++i) out.push_back(arc->at(static_cast<double>(i) / count));
    out.push_back(piece.to);
  }
  return out;
}

}  // namespace weldcell::workpiece
