#include "weldcell/localize/height.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

namespace weldcell::localize {

namespace {

constexpr std::size_t kMinHeights = 6;
constexpr double kFirstScale_mm = 5;
/// A slope beyond a few hundredths is no table; weak knowledge keeps a scan along one line solvable.
constexpr double kSlopeSigma = 0.05;
/// Leaning by less changes nothing.
constexpr double kLeast_mm = 0.01;
/// Of the shift that a lean makes, 1 sigma.
constexpr double kUnknownShare = 0.25;

struct Height {
  Eigen::Vector3d row;
  double z;
};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::optional<TiltedPlane> fit_plane(std::span<const EdgePoint> edges, std::span<const double> z_mm,
                                     const Vec2& reference, double sigma_mm) {
  std::vector<Height> heights;
  std::vector<double> all;
  for (std::size_t i = 0; i < std::min(edges.size(), z_mm.size()); ++i) {
    if (!std::isfinite(z_mm[i]) || !std::isfinite(edges[i].x_mm) || !std::isfinite(edges[i].y_mm)) continue;
    heights.push_back({{1, edges[i].x_mm - reference.x(), edges[i].y_mm - reference.y()}, z_mm[i]});
    all.push_back(z_mm[i]);
  }
  if (heights.size() < kMinHeights) return std::nullopt;
  Eigen::Vector3d plane(median(std::move(all)), 0, 0);
  const double last = std::max(3 * sigma_mm, 0.3);
  TiltedPlane out;
  double scale = kFirstScale_mm, square = 0, kept = 0;
  for (int step = 0; step < 20; ++step, scale = std::max(last, 0.7 * scale)) {
    Eigen::Matrix3d normal =
        Eigen::Vector3d(1e-8, 1 / (kSlopeSigma * kSlopeSigma), 1 / (kSlopeSigma * kSlopeSigma)).asDiagonal();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    square = kept = 0;
    out.points = 0;
    for (const Height& h : heights) {
      const double miss = h.z - h.row.dot(plane), ratio = 1 + miss * miss / (scale * scale);
      const double weight = 1 / (ratio * ratio);
      normal += weight / (sigma_mm * sigma_mm) * h.row * h.row.transpose();
      right += weight / (sigma_mm * sigma_mm) * h.z * h.row;
      square += weight * miss * miss;
      kept += weight;
      out.points += std::abs(miss) < scale;
    }
    const Eigen::LDLT<Eigen::Matrix3d> factor(normal);
    plane = factor.solve(right);
    out.covariance = factor.solve(Eigen::Matrix3d::Identity());
  }
  out.z_mm = plane(0);
  out.slope_x = plane(1);
  out.slope_y = plane(2);
  out.rms_mm = std::sqrt(square / std::max(kept, 1.0));
  // Heights that scatter more than stated widen the covariance.
  out.covariance *= std::max(1.0, out.rms_mm * out.rms_mm / (sigma_mm * sigma_mm));
  return out;
}

}  // namespace

HeightFit fit_heights(std::span<const EdgePoint> edges, std::span<const double> top_z_mm,
                      std::span<const double> table_z_mm, const Vec2& reference, double sigma_mm) {
  HeightFit out;
  out.reference = reference;
  const double sigma = std::isfinite(sigma_mm) ? std::clamp(sigma_mm, 0.005, 5.0) : 0.1;
  out.top = fit_plane(edges, top_z_mm, reference, sigma);
  out.table = fit_plane(edges, table_z_mm, reference, sigma);
  return out;
}

std::vector<EdgePoint> upright(std::span<const EdgePoint> edges, const Localization& found,
                               const workpiece::OutlineTemplate& outline, const TiltedPlane& top) {
  std::vector<EdgePoint> out(edges.begin(), edges.end());
  const Vec2 slope(top.slope_x, top.slope_y);
  for (std::size_t i = 0; i < std::min(out.size(), found.edge_of_point.size()); ++i) {
    if (found.edge_of_point[i] < 0 || out[i].shadowed) continue;
    const workpiece::VisibleEdge& edge = outline.edges[static_cast<std::size_t>(found.edge_of_point[i])];
    const Vec2 n = found.pose.rotate(edge.outward);
    // From the part's upper outline outwards: where the wall begins, below a round edge, and its foot.
    const double lean = outline.height_mm * n.dot(slope), begins = edge.radius_mm * n.dot(slope);
    const double seen = lean > 0 ? (begins + lean) / 2 : begins;
    out[i].x_mm -= seen * n.x();
    out[i].y_mm -= seen * n.y();
  }
  return out;
}

LeaningFit localize_leaning(const Localizer& localizer, std::span<const EdgePoint> edges,
                            std::span<const double> top_z_mm, std::span<const double> table_z_mm,
                            std::span<const PathPiece> path, const LocalizeOptions& options,
                            double sigma_mm) {
  LeaningFit out;
  out.found = localizer.localize(edges, path, options);
  out.heights = fit_heights(edges, top_z_mm, table_z_mm, out.found.centroid_base, sigma_mm);
  if (!out.heights.top) return out;
  const TiltedPlane& top = *out.heights.top;
  const double height_mm = localizer.outline().height_mm;
  if (height_mm * std::hypot(top.slope_x, top.slope_y) < kLeast_mm) return out;
  const Vec2 before = out.found.centroid_base;
  out.found = localizer.localize(upright(edges, out.found, localizer.outline(), top), path, options);
  const Vec2 unknown = kUnknownShare * (out.found.centroid_base - before);
  if (unknown.allFinite()) out.found.covariance.topLeftCorner<2, 2>() += unknown * unknown.transpose();
  return out;
}

}  // namespace weldcell::localize
