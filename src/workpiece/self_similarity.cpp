#include "self_similarity.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "weldcell/base/units.hpp"

namespace weldcell::workpiece {

namespace {

constexpr double kReach_mm = 60.0;  ///< farther than this an edge has no partner
constexpr int kSearchSamples = 120;
constexpr int kGapSamples = 600;
constexpr int kPolishSteps = 25;

struct Sample {
  Vec2 point, outward;
};

/// About `count` points, evenly along the visible length, each with its edge's outward normal.
std::vector<Sample> sampled(const OutlineTemplate& outline, int count) {
  double length = 0;
  for (const VisibleEdge& edge : outline.edges) length += edge.line.length();
  const double step = length / count;
  std::vector<Sample> out;
  for (const VisibleEdge& edge : outline.edges) {
    const int n = std::max(1, static_cast<int>(std::round(edge.line.length() / step)));
    for (int i = 0; i < n; ++i) {
      const double t = (i + 0.5) / n;
      out.push_back({edge.line.a + t * (edge.line.b - edge.line.a), edge.outward});
    }
  }
  return out;
}

struct Partner {
  double distance_mm = kReach_mm;
  const VisibleEdge* edge = nullptr;
};

/// The closest edge that faces the same way within 60 degrees.
Partner partner_of(const OutlineTemplate& outline, const Vec2& p, const Vec2& outward) {
  Partner best;
  for (const VisibleEdge& edge : outline.edges) {
    if (edge.outward.dot(outward) < 0.5) continue;
    const double d = distance(p, edge.line);
    if (d < best.distance_mm) best = {d, &edge};
  }
  return best;
}

double gap(const OutlineTemplate& outline, const std::vector<Sample>& samples, const Pose2& map) {
  double sum = 0;
  for (const Sample& sample : samples) {
    const double d = partner_of(outline, map * sample.point, map.rotate(sample.outward)).distance_mm;
    sum += d * d;
  }
  return std::sqrt(sum / static_cast<double>(samples.size()));
}

/// The pose that turns by theta about `centre` and then shifts.
Pose2 about(const Vec2& centre, double theta, const Vec2& shift) {
  Pose2 out{0, 0, wrap_pi(theta)};
  const Vec2 t = centre - out.rotate(centre) + shift;
  out.x_mm = t.x();
  out.y_mm = t.y();
  return out;
}

/// Point-to-line Gauss-Newton with closest partners, each weighted by Geman-McClure's 1 / (1 + d^2/c^2)^2.
Pose2 polished(const OutlineTemplate& outline, const std::vector<Sample>& samples, Pose2 map) {
  double scale = 20;
  for (int step = 0; step < kPolishSteps; ++step, scale = std::max(3.0, scale * 0.8)) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Identity() * 1e-9;
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    const Vec2 centre = map * outline.centroid;
    for (const Sample& sample : samples) {
      const Vec2 p = map * sample.point;
      const Partner partner = partner_of(outline, p, map.rotate(sample.outward));
      if (partner.edge == nullptr) continue;
      const Vec2& n = partner.edge->outward;
      const double residual = n.dot(p - partner.edge->line.a);
      const Vec2 arm = p - centre;
      const Eigen::Vector3d j(n.x(), n.y(), n.y() * arm.x() - n.x() * arm.y());
      const double ratio = 1 + partner.distance_mm * partner.distance_mm / (scale * scale);
      normal += j * j.transpose() / (ratio * ratio);
      right -= j * residual / (ratio * ratio);
    }
    const Eigen::Vector3d delta = normal.ldlt().solve(right);
    if (!delta.allFinite()) break;
    map = about(outline.centroid, map.theta_rad + delta.z(), centre + delta.head<2>() - outline.centroid);
  }
  return map;
}

bool same(const OutlineTemplate& outline, const Pose2& a, const Pose2& b) {
  return std::abs(wrap_pi(a.theta_rad - b.theta_rad)) * outline.radius_mm < 10 &&
         (a * outline.centroid - b * outline.centroid).norm() < 10;
}

}  // namespace

std::vector<Symmetry> find_symmetries(const OutlineTemplate& outline) {
  const std::vector<Sample> samples = sampled(outline, kSearchSamples);
  const std::vector<Sample> fine = sampled(outline, kGapSamples);
  const int turns = std::clamp(static_cast<int>(2 * kPi * outline.radius_mm / 10), 90, 720);
  std::vector<double> score(static_cast<std::size_t>(turns));
  for (int i = 0; i < turns; ++i) {
    score[static_cast<std::size_t>(i)] =
        gap(outline, samples, about(outline.centroid, 2 * kPi * i / turns, Vec2::Zero()));
  }
  std::vector<Symmetry> found;
  for (int i = 1; i < turns; ++i) {
    const double here = score[static_cast<std::size_t>(i)];
    const double next = score[static_cast<std::size_t>((i + 1) % turns)];
    if (here > score[static_cast<std::size_t>(i - 1)] || here > next || here > 0.7 * kReach_mm) continue;
    const Pose2 map = polished(outline, samples, about(outline.centroid, 2 * kPi * i / turns, Vec2::Zero()));
    if (same(outline, map, Pose2{})) continue;
    if (std::any_of(found.begin(), found.end(), [&](const Symmetry& s) { return same(outline, s.map, map); }))
      continue;
    const double rms = gap(outline, fine, map);
    if (rms <= kNearSymmetry_mm) found.push_back({map, rms});
  }
  for (Symmetry& symmetry : found) {
    if (symmetry.gap_mm < kTrueSymmetry_mm) symmetry.gap_mm = 0;
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Symmetry& a, const Symmetry& b) { return a.gap_mm < b.gap_mm; });
  if (found.size() > kMaxSymmetries) found.resize(kMaxSymmetries);
  return found;
}

}  // namespace weldcell::workpiece
