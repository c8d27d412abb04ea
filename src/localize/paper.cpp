#include "paper.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "weldcell/base/units.hpp"

namespace weldcell::localize::paper {

namespace {

using Parameters = Eigen::Vector3d;  ///< centroid x, y (mm) and turn in units of kTurnUnit_rad
using Cost = std::function<double(const Parameters&)>;

/// Makes one unit of turn move the outline about as far as one millimetre of shift.
constexpr double kTurnUnit_rad = 0.0035;
constexpr double kSeedSpread_mm = 50;
constexpr double kSeedSpread_rad = rad(20);
constexpr int kMaxRounds = 60;
constexpr double kTolerance = 1e-7;

/// Seeds about the centre of mass and orientation of the edges: shares of the spread in x, y, turn.
constexpr std::array<std::array<double, 3>, 7> kSeeds{{{0, 0, 0},
                                                       {0.5, 0.3, 0.5},
                                                       {-0.4, 0.5, -0.5},
                                                       {0.2, -0.6, 0.9},
                                                       {-0.6, -0.3, -0.9},
                                                       {0.9, -0.1, -0.2},
                                                       {-0.1, 0.9, 0.25}}};

std::vector<Segment> segments_of(const workpiece::OutlineTemplate& outline) {
  std::vector<Segment> out;
  for (const Polygon& member : outline.members) {
    for (std::size_t i = 0; i < member.size(); ++i) {
      out.push_back({member[i] - outline.centroid, member[(i + 1) % member.size()] - outline.centroid});
    }
  }
  return out;
}

double shortest_distance(const std::vector<Segment>& segments, const Vec2& p) {
  double best = std::numeric_limits<double>::max();
  for (const Segment& s : segments) {
    const Vec2 d = s.b - s.a, from = p - s.a;
    const double t = std::clamp(from.dot(d) / d.squaredNorm(), 0.0, 1.0);
    best = std::min(best, (from - t * d).squaredNorm());
  }
  return std::sqrt(best);
}

/// Brent's minimization along a line from the bracket (a, b, c); Brent, Algorithms for Minimization, 1973.
double brent(const std::function<double(double)>& f, double a, double b, double c, double* minimum) {
  constexpr double kGolden = 0.381966;
  double low = std::min(a, c), high = std::max(a, c), x = b, w = b, v = b, step = 0, previous = 0;
  double fx = f(x), fw = fx, fv = fx;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high), tolerance = 1e-4 * std::abs(x) + 1e-5;
    if (std::abs(x - middle) <= 2 * tolerance - 0.5 * (high - low)) break;
    bool golden = true;
    if (std::abs(previous) > tolerance) {
      const double r = (x - w) * (fx - fv), q0 = (x - v) * (fx - fw);
      double p = (x - v) * q0 - (x - w) * r, q = 2 * (q0 - r);
      if (q > 0) p = -p;
      q = std::abs(q);
      const double before = previous;
      previous = step;
      if (std::abs(p) < std::abs(0.5 * q * before) && p > q * (low - x) && p < q * (high - x)) {
        step = p / q;
        golden = false;
      }
    }
    if (golden) {
      previous = x >= middle ? low - x : high - x;
      step = kGolden * previous;
    }
    const double u = x + (std::abs(step) >= tolerance ? step : std::copysign(tolerance, step));
    const double fu = f(u);
    if (fu <= fx) {
      (u >= x ? low : high) = x;
      v = w, fv = fw, w = x, fw = fx, x = u, fx = fu;
    } else {
      (u < x ? low : high) = u;
      if (fu <= fw || w == x) {
        v = w, fv = fw, w = u, fw = fu;
      } else if (fu <= fv || v == x || v == w) {
        v = u, fv = fu;
      }
    }
  }
  *minimum = fx;
  return x;
}

/// Moves x to the minimum along the direction and returns the cost there.
double line_minimum(const Cost& cost, Parameters& x, const Parameters& direction, double here) {
  const auto along = [&](double t) { return cost(x + t * direction); };
  double a = 0, b = 1, fa = here, fb = along(b);
  if (fb > fa) std::swap(a, b), std::swap(fa, fb);
  double c = b + 1.618 * (b - a), fc = along(c);
  for (int i = 0; i < 40 && fc < fb; ++i) {
    a = b, b = c, fa = fb, fb = fc;
    c = b + 1.618 * (b - a);
    fc = along(c);
  }
  double minimum = 0;
  const double t = brent(along, a, b, c, &minimum);
  if (minimum >= here) return here;
  x += t * direction;
  return minimum;
}

/// Powell's direction-set method; Powell, Computer Journal 7 (1964), with the rule that drops the direction
/// of the largest decrease.
double powell(const Cost& cost, Parameters& x, int* iterations) {
  Eigen::Matrix3d directions = 4 * Eigen::Matrix3d::Identity();
  double here = cost(x);
  for (int round = 0; round < kMaxRounds; ++round) {
    ++*iterations;
    const Parameters start = x;
    const double before = here;
    double largest = 0;
    int steepest = 0;
    for (int i = 0; i < 3; ++i) {
      const double last = here;
      here = line_minimum(cost, x, directions.col(i), here);
      if (last - here > largest) largest = last - here, steepest = i;
    }
    if (2 * (before - here) <= kTolerance * (std::abs(before) + std::abs(here)) + 1e-12) break;
    const Parameters moved = x - start;
    const double extrapolated = cost(x + moved);
    if (extrapolated >= before) continue;
    const double t = 2 * (before - 2 * here + extrapolated) * std::pow(before - here - largest, 2) -
                     largest * std::pow(before - extrapolated, 2);
    if (t >= 0 || moved.norm() < 1e-9) continue;
    here = line_minimum(cost, x, moved, here);
    directions.col(steepest) = directions.col(2);
    directions.col(2) = moved;
  }
  return here;
}

/// Principal direction; nothing when the set has no longer side.
bool principal_angle(const std::vector<Vec2>& points, double* angle_rad) {
  Vec2 mean = Vec2::Zero();
  for (const Vec2& p : points) mean += p / static_cast<double>(points.size());
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
  for (const Vec2& p : points) scatter += (p - mean) * (p - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(scatter);
  if (!(axes.eigenvalues()(1) > 1.3 * axes.eigenvalues()(0))) return false;
  *angle_rad = std::atan2(axes.eigenvectors()(1, 1), axes.eigenvectors()(0, 1));
  return true;
}

/// Turn of the edges' principal axis against the template's, of the two the one closer to planned.
double orientation(const std::vector<Vec2>& points, const std::vector<Segment>& segments,
                   double planned_rad) {
  std::vector<Vec2> outline;
  for (const Segment& s : segments) {
    const int count = std::max(1, static_cast<int>(s.length() / 20));
    for (int i = 0; i < count; ++i) outline.push_back(s.a + (i + 0.5) / count * (s.b - s.a));
  }
  double seen = 0, drawn = 0;
  if (!principal_angle(points, &seen) || !principal_angle(outline, &drawn)) return planned_rad;
  const double off = wrap_pi(2 * (seen - drawn - planned_rad)) / 2;
  return planned_rad + off;
}

}  // namespace

Localization localize(const workpiece::OutlineTemplate& outline, const std::vector<Crossing>& crossings,
                      std::size_t point_count, const LocalizeOptions& options) {
  const std::vector<Segment> segments = segments_of(outline);
  std::vector<Vec2> points;
  Vec2 mass = Vec2::Zero();
  for (const Crossing& c : crossings) points.push_back(c.point), mass += c.point;
  mass /= static_cast<double>(points.size());
  const double turn = orientation(points, segments, options.planned.theta_rad);
  const Cost cost = [&](const Parameters& x) {
    const double c = std::cos(x.z() * kTurnUnit_rad), s = std::sin(x.z() * kTurnUnit_rad);
    double sum = 0;
    for (const Vec2& p : points) {
      const double dx = p.x() - x.x(), dy = p.y() - x.y();
      sum += shortest_distance(segments, {c * dx + s * dy, -s * dx + c * dy});
    }
    return sum;
  };
  Localization out;
  Parameters best = Parameters::Zero();
  double lowest = std::numeric_limits<double>::max();
  for (const auto& seed : kSeeds) {
    Parameters x(mass.x() + seed[0] * kSeedSpread_mm, mass.y() + seed[1] * kSeedSpread_mm,
                 (turn + seed[2] * kSeedSpread_rad) / kTurnUnit_rad);
    const double found = powell(cost, x, &out.iterations);
    if (found < lowest) lowest = found, best = x;
  }
  const double theta = wrap_pi(best.z() * kTurnUnit_rad);
  out.centroid_base = best.head<2>();
  const Vec2 t = out.centroid_base - Pose2{0, 0, theta}.rotate(outline.centroid);
  out.pose = {t.x(), t.y(), theta};
  out.points = static_cast<int>(point_count);
  out.mean_error_mm = lowest / static_cast<double>(points.size());
  out.inliers = static_cast<int>(points.size());
  out.edge_of_point.assign(point_count, -1);
  out.residual_mm.assign(point_count, 0);
  const bool accepted = out.mean_error_mm <= options.max_mean_error_mm;
  out.verdict = accepted ? Verdict::Weld : Verdict::Reject;
  out.cause = accepted ? "ok" : "mean_error";
  out.reason = accepted ? fmt::format("Mean error {:.2f} mm, at most {:.2f} mm allowed.", out.mean_error_mm,
                                      options.max_mean_error_mm)
                        : fmt::format("Mean error {:.2f} mm is above {:.2f} mm. Weld manually.",
                                      out.mean_error_mm, options.max_mean_error_mm);
  return out;
}

}  // namespace weldcell::localize::paper
