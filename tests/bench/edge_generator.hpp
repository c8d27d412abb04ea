// Simulated edge sets with known truth: weldments, raster and spiral scans, noise, clutter, drop-outs,
// members off, latency.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "weldcell/base/units.hpp"
#include "weldcell/localize/localize.hpp"
#include "weldcell/workpiece/outline_template.hpp"

namespace weldcell::bench {

using workpiece::Member;
using workpiece::OutlineTemplate;
using workpiece::Workpiece;

inline Member bar(const std::string& name, const Vec2& from, const Vec2& to, double width) {
  const Vec2 d = (to - from).normalized(), n = 0.5 * width * Vec2(-d.y(), d.x());
  Member out;
  out.name = out.tag = name;
  for (const Vec2& p : std::array<Vec2, 4>{from - n, to - n, to + n, from + n}) out.outline.push_back(p);
  return out;
}

/// A quadrilateral from its corners' coordinates.
inline Member quad(const std::string& name, const std::array<double, 8>& xy) {
  Member out;
  out.name = out.tag = name;
  for (std::size_t i = 0; i < 8; i += 2) out.outline.emplace_back(xy[i], xy[i + 1]);
  return out;
}

inline Workpiece weldment(const std::string& name, std::vector<Member> members) {
  Workpiece w;
  w.name = name;
  w.height_mm = 40;
  w.members = std::move(members);
  return *workpiece::validated(std::move(w));
}

inline Workpiece ladder() {
  std::vector<Member> m{bar("m0", {-492, -225}, {508, -225}, 50), bar("m1", {-492, 225}, {508, 225}, 50)};
  int i = 2;
  for (const double x : {-467.0, -162.0, 108.0, 483.0})
    m.push_back(bar("m" + std::to_string(i++), {x, -200}, {x, 200}, 50));
  return weldment("ladder", m);
}

inline Workpiece rect() {
  return weldment("rect", {bar("m0", {-400, -230}, {400, -230}, 40), bar("m1", {-400, 230}, {400, 230}, 40),
                           bar("m2", {-380, -210}, {-380, 210}, 40), bar("m3", {380, -210}, {380, 210}, 40)});
}

inline Workpiece nearsym() {
  return weldment("nearsym",
                  {bar("m0", {-300, -280}, {300, -280}, 40), bar("m1", {-300, 280}, {300, 280}, 40),
                   bar("m2", {-280, -260}, {-280, 260}, 40), bar("m3", {280, -260}, {280, 260}, 40),
                   bar("m4", {3, -260}, {3, 260}, 40)});
}

inline Workpiece mitre() {
  return weldment("mitre", {quad("m0", {-350, -250, 350, -250, 300, -200, -300, -200}),
                            quad("m1", {350, -250, 350, 250, 300, 200, 300, -200}),
                            quad("m2", {350, 250, -350, 250, -300, 200, 300, 200}),
                            quad("m3", {-350, 250, -350, -250, -300, -200, -300, 200}),
                            quad("m4", {40, -200, 90, -200, 90, 200, 40, 200})});
}

inline Workpiece aframe() {
  return weldment("aframe",
                  {bar("m0", {-400, -260}, {400, -260}, 60), bar("m1", {-330, -230}, {-30, 300}, 50),
                   bar("m2", {330, -230}, {30, 300}, 50), bar("m3", {-190, 0}, {190, 0}, 40)});
}

/// Three members only: little redundancy when parts are off.
inline Workpiece corner() {
  return weldment("corner",
                  {bar("m0", {-350, -250}, {350, -250}, 50), bar("m1", {-325, -225}, {-325, 300}, 50),
                   bar("m2", {120, -225}, {120, 150}, 50)});
}

/// Two rails and `rungs` rungs at uneven places.
inline Workpiece comb(int rungs) {
  std::vector<Member> m{bar("r0", {-900, -200}, {900, -200}, 12), bar("r1", {-900, 200}, {900, 200}, 12)};
  for (int i = 0; i < rungs; ++i) {
    const double x = -880 + 1760 * (i + 0.5 + 0.3 * std::sin(12.9898 * i)) / rungs;
    m.push_back(bar("g" + std::to_string(i), {x, -194}, {x, 194}, std::min(12.0, 700.0 / rungs)));
  }
  return weldment("comb" + std::to_string(rungs + 2), m);
}

struct Setting {
  double sigma_mm = 0.3, outliers = 0.05, latency_s = 0, pitch_mm = 40, speed_mm_s = 200;
  double drop_out = 0;
  int members_missing = 0;
  double member_mm = 0, member_deg = 0;
  double shift_mm = 15, turn_deg = 20;  ///< the part lies within these of planned, each axis
  bool spiral = false;
};

struct EdgeSet {
  std::vector<EdgePoint> edges;
  std::vector<PathPiece> path;
  Pose2 truth;
  std::vector<Pose2> member_moves;  ///< each member's own, frame Part
  std::vector<int> edge_of_point;   ///< true edge, -1 = clutter
};

/// A move by (dx, dy, dtheta) about a point.
inline Pose2 move_about(const Vec2& centre, double dx, double dy, double dtheta) {
  Pose2 out{0, 0, dtheta};
  const Vec2 t = centre - out.rotate(centre) + Vec2(dx, dy);
  return {t.x(), t.y(), dtheta};
}

/// To and fro over a disc, in lines along x and then along y.
inline std::vector<PathPiece> raster(double radius, double pitch, double phase) {
  std::vector<PathPiece> out;
  bool back = false;
  for (const bool upright : {false, true}) {
    for (double at = -radius + pitch * (0.25 + 0.5 * phase); at < radius; at += pitch) {
      const double half = std::sqrt(std::max(0.0, radius * radius - at * at));
      const double from = back ? half : -half;
      out.push_back(upright ? PathPiece{at, from, at, -from} : PathPiece{from, at, -from, at});
      back = !back;
    }
  }
  return out;
}

/// One way, from the middle outwards.
inline std::vector<PathPiece> spiral(double radius, double pitch) {
  std::vector<PathPiece> out;
  double angle = 0;
  const auto at = [&](double a) -> Vec2 { return Vec2(std::cos(a), std::sin(a)) * (pitch * a / (2 * kPi)); };
  while (pitch * angle / (2 * kPi) < radius) {
    const double next = angle + 1.5 / std::max(pitch * angle / (2 * kPi), 3.0);
    const Vec2 p = at(angle), q = at(next);
    out.push_back({p.x(), p.y(), q.x(), q.y()});
    angle = next;
  }
  return out;
}

/// What the scan of a part sees. `part` is what lies there; its members move by the setting's tolerance.
inline EdgeSet make_set(const OutlineTemplate& part, const Setting& setting, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal(0, 1);
  const auto within = [&](double limit) { return limit * (2 * uniform(random) - 1); };
  EdgeSet out;
  out.truth = {within(setting.shift_mm), within(setting.shift_mm), rad(within(setting.turn_deg))};
  for (const Polygon& member : part.members) {
    const double dx = within(setting.member_mm), dy = within(setting.member_mm);
    out.member_moves.push_back(move_about(centroid(member), dx, dy, rad(within(setting.member_deg))));
  }
  std::vector<bool> gone(part.members.size(), false);
  for (int i = 0; i < setting.members_missing; ++i) gone[random() % gone.size()] = true;
  const double radius = part.radius_mm + 40 + setting.shift_mm;
  out.path =
      setting.spiral ? spiral(radius, setting.pitch_mm) : raster(radius, setting.pitch_mm, uniform(random));
  struct Line {
    Vec2 a, d, n;
    double length;
  };
  std::vector<Line> lines;
  for (const workpiece::VisibleEdge& e : part.edges) {
    const Pose2 to_base = out.truth * out.member_moves[static_cast<std::size_t>(e.member)];
    const Vec2 a = to_base * e.line.a, b = to_base * e.line.b;
    lines.push_back({a, (b - a).normalized(), to_base.rotate(e.outward), (b - a).norm()});
  }
  for (const PathPiece& piece : out.path) {
    const Vec2 from(piece.x0_mm, piece.y0_mm), to(piece.x1_mm, piece.y1_mm),
        travel = (to - from).normalized();
    for (std::size_t e = 0; e < lines.size(); ++e) {
      const Line& line = lines[e];
      const double f = (from - line.a).dot(line.n), t = (to - line.a).dot(line.n);
      if ((f < 0) == (t < 0)) continue;
      const Vec2 p = from + f / (f - t) * (to - from);
      const double along = (p - line.a).dot(line.d), across = travel.dot(line.n);
      if (along < 0 || along > line.length || std::abs(across) < 0.1) continue;
      if (gone[static_cast<std::size_t>(part.edges[e].member)] || uniform(random) < setting.drop_out)
        continue;
      const Vec2 seen = p + setting.sigma_mm * Vec2(normal(random), normal(random)) +
                        setting.speed_mm_s * setting.latency_s * travel;
      out.edges.push_back({seen.x(), seen.y(), travel.x(), travel.y(), across < 0 ? 1 : -1, setting.sigma_mm,
                           setting.speed_mm_s, false});
      out.edge_of_point.push_back(static_cast<int>(e));
    }
  }
  const auto clutter = static_cast<int>(
      std::lround(static_cast<double>(out.edges.size()) * setting.outliers / (1 - setting.outliers)));
  for (int i = 0; i < clutter; ++i) {
    const double r = radius * std::sqrt(uniform(random)), a = 2 * kPi * uniform(random);
    const PathPiece& piece = out.path[random() % out.path.size()];
    const Vec2 travel = Vec2(piece.x1_mm - piece.x0_mm, piece.y1_mm - piece.y0_mm).normalized();
    out.edges.push_back({r * std::cos(a), r * std::sin(a), travel.x(), travel.y(),
                         uniform(random) < 0.5 ? 1 : -1, setting.sigma_mm, setting.speed_mm_s, false});
    out.edge_of_point.push_back(-1);
  }
  return out;
}

/// The lowest covariance of (x, y, theta) at the centroid that any unbiased estimate of the true
/// correspondences can have: generalized least squares with the members' true variances; latency counts as
/// unknown when it is not zero.
inline Eigen::Matrix3d bound(const OutlineTemplate& part, const Setting& setting, const EdgeSet& set) {
  using Matrix4 = Eigen::Matrix4d;
  const double weight = 1 / (setting.sigma_mm * setting.sigma_mm);
  const double shift2 = setting.member_mm * setting.member_mm / 3;
  const double angle2 = rad(setting.member_deg) * rad(setting.member_deg) / 3;
  std::vector<Matrix4> common(part.members.size(), Matrix4::Zero());
  std::vector<Eigen::Matrix3d> gram(part.members.size(), Eigen::Matrix3d::Zero());
  std::vector<Eigen::Matrix<double, 3, 4>> cross(part.members.size(), Eigen::Matrix<double, 3, 4>::Zero());
  const Vec2 centre = set.truth * part.centroid;
  for (std::size_t i = 0; i < set.edges.size(); ++i) {
    if (set.edge_of_point[i] < 0) continue;
    const workpiece::VisibleEdge& e = part.edges[static_cast<std::size_t>(set.edge_of_point[i])];
    const auto m = static_cast<std::size_t>(e.member);
    const EdgePoint& p = set.edges[i];
    const Vec2 n = set.truth.rotate(e.outward), arm = Vec2(p.x_mm, p.y_mm) - centre;
    const Vec2 own = Vec2(p.x_mm, p.y_mm) - set.truth * centroid(part.members[m]);
    const double across = n.x() * p.dir_x + n.y() * p.dir_y;
    const Eigen::Vector4d j(n.x(), n.y(), n.y() * arm.x() - n.x() * arm.y(),
                            setting.latency_s != 0 ? across * setting.speed_mm_s * 1e-3 : 0);
    const Eigen::Vector3d h(n.x(), n.y(), n.y() * own.x() - n.x() * own.y());
    common[m] += weight * j * j.transpose();
    gram[m] += weight * h * h.transpose();
    cross[m] += weight * h * j.transpose();
  }
  Matrix4 information = Matrix4::Zero();
  information(3, 3) = setting.latency_s != 0 ? 0 : 1;
  for (std::size_t m = 0; m < part.members.size(); ++m) {
    information += common[m];
    if (shift2 <= 0) continue;
    Eigen::Matrix3d inner = gram[m];
    inner.diagonal() += Eigen::Vector3d(1 / shift2, 1 / shift2, 1 / std::max(angle2, 1e-12));
    information -= cross[m].transpose() * inner.inverse() * cross[m];
  }
  return Matrix4(information.inverse()).topLeftCorner<3, 3>();
}

}  // namespace weldcell::bench
