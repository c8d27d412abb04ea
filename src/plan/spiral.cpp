#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "patterns.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::plan {

namespace {

double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Area, first and second moments of the members, as if cut from one sheet.
struct Moments {
  double area = 0;
  Vec2 first = Vec2::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();

  void add(const Polygon& polygon) {
    const double sense = signed_area(polygon) < 0 ? -1 : 1;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vec2 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
      const double w = sense * cross(a, b);
      area += w / 2;
      first += w / 6 * (a + b);
      second +=
          w / 24 * (2 * a * a.transpose() + 2 * b * b.transpose() + a * b.transpose() + b * a.transpose());
    }
  }
  Vec2 centroid() const { return first / area; }
  /// Unit vector of the largest extension; +X where there is none.
  Vec2 major() const {
    const Vec2 c = centroid();
    const Eigen::Matrix2d spread = second / area - c * c.transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(spread);
    if (axes.eigenvalues()(1) - axes.eigenvalues()(0) < 1e-6 * axes.eigenvalues()(1)) return Vec2::UnitX();
    Vec2 out = axes.eigenvectors().col(1);
    if (out.x() < -1e-9 || (std::abs(out.x()) <= 1e-9 && out.y() < 0)) out = -out;
    return out;
  }
};

/// Largest coordinate along `axis` of p while it swings by up to swing_rad about the origin.
double swept(const Vec2& p, const Vec2& axis, double swing_rad) {
  const double off = std::abs(std::atan2(cross(axis, p), axis.dot(p)));
  return p.norm() * std::cos(std::max(0.0, off - swing_rad));
}

struct Ellipse {
  Vec2 centre, major, minor;
  double half_major = 0, half_minor = 0;
};

/// Inscribed in the box around the outline along its principal axes, grown by how far the part may lie from
/// its plan.
Ellipse ellipse_over(const workpiece::Workpiece& workpiece, const Inspection& inspection) {
  Moments moments;
  for (const workpiece::Member& m : workpiece.members) moments.add(m.outline);
  const Vec2 centroid = moments.centroid();
  Ellipse e;
  e.major = moments.major();
  e.minor = {-e.major.y(), e.major.x()};
  double reach[4] = {0, 0, 0, 0};
  const Vec2 axes[4] = {e.major, -e.major, e.minor, -e.minor};
  for (const workpiece::Member& m : workpiece.members) {
    for (const Vec2& p : m.outline) {
      for (int i = 0; i < 4; ++i) {
        reach[i] =
            std::max(reach[i], swept(p - centroid, axes[i], inspection.margin_rad) + inspection.margin_mm);
      }
    }
  }
  e.half_major = (reach[0] + reach[1]) / 2;
  e.half_minor = (reach[2] + reach[3]) / 2;
  e.centre = centroid + (reach[0] - reach[1]) / 2 * e.major + (reach[2] - reach[3]) / 2 * e.minor;
  if (e.half_minor > e.half_major) {
    std::swap(e.half_major, e.half_minor);
    e.major = e.minor;
    e.minor = {-e.major.y(), e.major.x()};
  }
  return e;
}

}  // namespace

std::vector<BeamPath> spiral_paths(const workpiece::Workpiece& workpiece, const Inspection& inspection) {
  if (workpiece.members.empty()) return {};
  const Ellipse e = ellipse_over(workpiece, inspection);
  // Finer than this no scan would end: plan_scan() refuses it by its length.
  const double pitch = std::clamp(inspection.pitch_mm, e.half_major / 200, e.half_major);
  const double end = 2 * kPi * e.half_major / pitch;
  const double step = std::clamp(pitch / 20, 0.5, 5.0);
  // r = pitch * turns: the ellipse's axes grow in proportion, so the gap between turns is the pitch along the
  // major axis and less along the minor one.
  const auto point = [&](double turn) -> Vec2 {
    const double grown = turn / end;
    return e.centre +
           grown * (e.half_major * std::cos(turn) * e.major + e.half_minor * std::sin(turn) * e.minor);
  };
  const auto pace = [&](double turn) {
    const Vec2 d(e.half_major * (std::cos(turn) - turn * std::sin(turn)),
                 e.half_minor * (std::sin(turn) + turn * std::cos(turn)));
    return d.norm() / end;
  };
  BeamPath path;
  path.name = "spiral";
  path.receiver_angle_rad = std::atan2(e.major.y(), e.major.x());
  // Half a turn from the centre the curve is wide enough to be entered at speed.
  double turn = std::min(kPi, end / 4);
  while (turn < end) {
    path.points.push_back(point(turn));
    const double half = turn + step / (2 * pace(turn));
    turn += step / pace(half);
  }
  path.points.push_back(point(end));
  return {path};
}

std::vector<BeamPath> beam_paths(const workpiece::Workpiece& workpiece, const Pose2& pose,
                                 const Inspection& inspection, Pattern pattern) {
  std::vector<BeamPath> paths;
  if (pattern == Pattern::Zigzag) paths = zigzag_paths(workpiece, inspection);
  if (pattern != Pattern::Zigzag) paths = spiral_paths(workpiece, inspection);  // Adaptive begins with it
  for (BeamPath& path : paths) {
    for (Vec2& p : path.points) p = pose * p;
    path.receiver_angle_rad = wrap_pi(path.receiver_angle_rad + pose.theta_rad);
  }
  return paths;
}

}  // namespace weldcell::plan
