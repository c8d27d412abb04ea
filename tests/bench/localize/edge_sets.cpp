#include "edge_sets.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <random>

#include "weldcell/base/units.hpp"

namespace weldcell::bench {

using workpiece::OutlineTemplate;

namespace {

constexpr double kInsetPrior_mm = 0.5;
constexpr double kDrawnFromCorner_mm = 100;

/// A move by (dx, dy, dtheta) about a point.
Pose2 move_about(const Vec2& centre, double dx, double dy, double dtheta) {
  Pose2 out{0, 0, dtheta};
  const Vec2 t = centre - out.rotate(centre) + Vec2(dx, dy);
  return {t.x(), t.y(), dtheta};
}

/// The scan of one part that lies somewhere; draws everything from one stream of random numbers.
class Scene {
 public:
  Scene(const OutlineTemplate& part, const Setting& setting, std::uint64_t seed)
      : part_(part), setting_(setting), random_(seed) {
    // A part drawn from a corner turns about its middle as well, and the scan goes over it there.
    if (part.centroid.norm() > kDrawnFromCorner_mm) middle_ = part.centroid;
  }

  EdgeSet scan(std::span<const PathPiece> path) {
    place();
    const double radius = part_.radius_mm + 40 + setting_.shift_mm;
    if (!path.empty()) {
      set_.path.assign(path.begin(), path.end());
    } else if (setting_.spiral) {
      set_.path = spiral(radius, setting_.pitch_mm);
    } else {
      set_.path = raster(radius, setting_.pitch_mm, uniform_(random_));
    }
    if (path.empty()) {
      for (PathPiece& p : set_.path) {
        p = {p.x0_mm + middle_.x(), p.y0_mm + middle_.y(), p.x1_mm + middle_.x(), p.y1_mm + middle_.y()};
      }
    }
    for (const PathPiece& piece : set_.path) cross(piece);
    clutter(radius);
    return std::move(set_);
  }

 private:
  struct Line {
    Vec2 a, d, n;
    double length;
  };

  double within(double limit) { return limit * (2 * uniform_(random_) - 1); }

  void place() {
    const double dx = within(setting_.shift_mm), dy = within(setting_.shift_mm);
    set_.truth = move_about(middle_, dx, dy, rad(within(setting_.turn_deg)));
    for (const Polygon& member : part_.members) {
      const double mx = within(setting_.member_mm), my = within(setting_.member_mm);
      set_.member_moves.push_back(move_about(centroid(member), mx, my, rad(within(setting_.member_deg))));
    }
    gone_.assign(part_.members.size(), false);
    for (int i = 0; i < setting_.members_missing; ++i) gone_[random_() % gone_.size()] = true;
    for (const workpiece::VisibleEdge& e : part_.edges) {
      const Pose2 to_base = set_.truth * set_.member_moves[static_cast<std::size_t>(e.member)];
      const Vec2 inset = e.round ? Vec2(-setting_.inset_mm * e.outward) : Vec2(0, 0);
      const Vec2 a = to_base * Vec2(e.line.a + inset), b = to_base * Vec2(e.line.b + inset);
      lines_.push_back({a, (b - a).normalized(), to_base.rotate(e.outward), (b - a).norm()});
    }
  }

  void cross(const PathPiece& piece) {
    const Vec2 from(piece.x0_mm, piece.y0_mm), to(piece.x1_mm, piece.y1_mm);
    const Vec2 travel = (to - from).normalized();
    for (std::size_t e = 0; e < lines_.size(); ++e) {
      const Line& line = lines_[e];
      const double f = (from - line.a).dot(line.n), t = (to - line.a).dot(line.n);
      if ((f < 0) == (t < 0)) continue;
      const Vec2 p = from + f / (f - t) * (to - from);
      const double along = (p - line.a).dot(line.d), across = travel.dot(line.n);
      if (along < 0 || along > line.length || std::abs(across) < kGrazing) continue;
      if (gone_[static_cast<std::size_t>(part_.edges[e].member)] || uniform_(random_) < setting_.drop_out)
        continue;
      const Vec2 seen = p + setting_.sigma_mm * Vec2(normal_(random_), normal_(random_)) +
                        setting_.speed_mm_s * setting_.latency_s * travel;
      add(seen, travel, across < 0 ? 1 : -1, static_cast<int>(e));
    }
  }

  void clutter(double radius) {
    const auto count = static_cast<int>(
        std::lround(static_cast<double>(set_.edges.size()) * setting_.outliers / (1 - setting_.outliers)));
    for (int i = 0; setting_.strays_on_path && i < count; ++i) clutter_on_path();
    for (int i = 0; !setting_.strays_on_path && i < count; ++i) {
      const double r = radius * std::sqrt(uniform_(random_)), a = 2 * kPi * uniform_(random_);
      const PathPiece& piece = set_.path[random_() % set_.path.size()];
      const Vec2 travel = Vec2(piece.x1_mm - piece.x0_mm, piece.y1_mm - piece.y0_mm).normalized();
      add(middle_ + r * Vec2(std::cos(a), std::sin(a)), travel, uniform_(random_) < 0.5 ? 1 : -1, -1);
    }
  }

  void clutter_on_path() {
    double length = 0;
    for (const PathPiece& p : set_.path) length += std::hypot(p.x1_mm - p.x0_mm, p.y1_mm - p.y0_mm);
    double left = length * uniform_(random_);
    for (const PathPiece& p : set_.path) {
      const Vec2 by(p.x1_mm - p.x0_mm, p.y1_mm - p.y0_mm);
      if (left > by.norm()) {
        left -= by.norm();
        continue;
      }
      add(Vec2(p.x0_mm, p.y0_mm) + left * by.normalized(), by.normalized(), uniform_(random_) < 0.5 ? 1 : -1,
          -1);
      return;
    }
  }

  void add(const Vec2& at, const Vec2& travel, int step, int edge) {
    set_.edges.push_back(
        {at.x(), at.y(), travel.x(), travel.y(), step, setting_.sigma_mm, setting_.speed_mm_s, false});
    set_.edge_of_point.push_back(edge);
  }

  const OutlineTemplate& part_;
  const Setting& setting_;
  std::mt19937_64 random_;
  std::uniform_real_distribution<double> uniform_{0, 1};
  std::normal_distribution<double> normal_{0, 1};
  Vec2 middle_ = Vec2::Zero();
  EdgeSet set_;
  std::vector<bool> gone_;
  std::vector<Line> lines_;
};

}  // namespace

std::vector<PathPiece> raster(double radius_mm, double pitch_mm, double phase) {
  std::vector<PathPiece> out;
  bool back = false;
  for (const bool upright : {false, true}) {
    for (double at = -radius_mm + pitch_mm * (0.25 + 0.5 * phase); at < radius_mm; at += pitch_mm) {
      const double half = std::sqrt(std::max(0.0, radius_mm * radius_mm - at * at));
      const double from = back ? half : -half;
      out.push_back(upright ? PathPiece{at, from, at, -from} : PathPiece{from, at, -from, at});
      back = !back;
    }
  }
  return out;
}

std::vector<PathPiece> spiral(double radius_mm, double pitch_mm) {
  std::vector<PathPiece> out;
  const double rise = pitch_mm / (2 * kPi);
  const auto at = [&](double a) -> Vec2 { return Vec2(std::cos(a), std::sin(a)) * (rise * a); };
  double angle = 0;
  while (rise * angle < radius_mm) {
    const double next = angle + 1.5 / std::max(rise * angle, 3.0);
    const Vec2 p = at(angle), q = at(next);
    out.push_back({p.x(), p.y(), q.x(), q.y()});
    angle = next;
  }
  return out;
}

EdgeSet make_set(const OutlineTemplate& part, const Setting& setting, std::uint64_t seed,
                 std::span<const PathPiece> path) {
  return Scene(part, setting, seed).scan(path);
}

Eigen::Matrix4d bound(const OutlineTemplate& part, const Setting& setting, const EdgeSet& set) {
  using Vector5 = Eigen::Matrix<double, 5, 1>;  // x, y, theta, latency ms, inset mm
  using Matrix5 = Eigen::Matrix<double, 5, 5>;
  const double weight = 1 / (setting.sigma_mm * setting.sigma_mm);
  const double shift2 = setting.member_mm * setting.member_mm / 3;
  const double angle2 = rad(setting.member_deg) * rad(setting.member_deg) / 3;
  const std::size_t members = part.members.size();
  std::vector<Matrix5> common(members, Matrix5::Zero());
  std::vector<Eigen::Matrix3d> gram(members, Eigen::Matrix3d::Zero());
  std::vector<Eigen::Matrix<double, 3, 5>> cross(members, Eigen::Matrix<double, 3, 5>::Zero());
  const Vec2 centre = set.truth * part.centroid;
  for (std::size_t i = 0; i < set.edges.size(); ++i) {
    if (set.edge_of_point[i] < 0) continue;
    const workpiece::VisibleEdge& e = part.edges[static_cast<std::size_t>(set.edge_of_point[i])];
    const auto m = static_cast<std::size_t>(e.member);
    const EdgePoint& p = set.edges[i];
    const Vec2 n = set.truth.rotate(e.outward), arm = Vec2(p.x_mm, p.y_mm) - centre;
    const Vec2 own = Vec2(p.x_mm, p.y_mm) - set.truth * centroid(part.members[m]);
    const double across = n.x() * p.dir_x + n.y() * p.dir_y;
    Vector5 j;
    j << n.x(), n.y(), n.y() * arm.x() - n.x() * arm.y(),
        setting.latency_s != 0 ? across * setting.speed_mm_s * 1e-3 : 0, e.round ? -1 : 0;
    const Eigen::Vector3d h(n.x(), n.y(), n.y() * own.x() - n.x() * own.y());
    common[m] += weight * j * j.transpose();
    gram[m] += weight * h * h.transpose();
    cross[m] += weight * h * j.transpose();
  }
  Matrix5 information = Matrix5::Zero();
  information(3, 3) = setting.latency_s != 0 ? 0 : 1;
  information(4, 4) = 1 / (kInsetPrior_mm * kInsetPrior_mm);
  for (std::size_t m = 0; m < members; ++m) {
    information += common[m];
    if (shift2 <= 0) continue;
    Eigen::Matrix3d inner = gram[m];
    inner.diagonal() += Eigen::Vector3d(1 / shift2, 1 / shift2, 1 / std::max(angle2, 1e-12));
    information -= cross[m].transpose() * inner.inverse() * cross[m];
  }
  return Matrix5(information.inverse()).topLeftCorner<4, 4>();
}

}  // namespace weldcell::bench
