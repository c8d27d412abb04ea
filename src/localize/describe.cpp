#include "describe.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "candidates.hpp"

namespace weldcell::localize {

namespace {

double mean_distance(const Fit& fit) {
  double sum = 0;
  for (const Match& m : fit.matches) sum += m.edge < 0 ? TemplateFields::kReach_mm : m.distance_mm;
  return sum / static_cast<double>(fit.matches.size());
}

void fill_members(const Situation& s, const Eigen::Matrix3d& to_base, Localization& result) {
  for (std::size_t m = 0; m < s.outline.members.size(); ++m) {
    MemberPose pose;
    pose.name = s.outline.member_names[m];
    const Eigen::Vector3d shift = to_base * s.fit.state.members[m];
    pose.dx_mm = shift.x();
    pose.dy_mm = shift.y();
    pose.dtheta_rad = shift.z();
    pose.covariance = to_base * s.fit.member_covariance[m] * to_base.transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(
        Eigen::Matrix2d(pose.covariance.topLeftCorner<2, 2>()));
    pose.sigma_mm = std::sqrt(std::max(0.0, axes.eigenvalues()(1)));
    pose.points = s.fit.member_points[m];
    result.members.push_back(std::move(pose));
  }
}

void fill_pose(const Situation& s, Localization& result) {
  result.pose = part_pose(s.outline, s.fit.state.pose);
  result.centroid_base = s.fit.state.pose.centre;
  const Pose2 turn{0, 0, result.pose.theta_rad};
  Eigen::Matrix3d to_base = Eigen::Matrix3d::Identity();
  to_base.topLeftCorner<2, 2>() << std::cos(turn.theta_rad), -std::sin(turn.theta_rad),
      std::sin(turn.theta_rad), std::cos(turn.theta_rad);
  result.covariance = to_base * s.fit.covariance.topLeftCorner<3, 3>() * to_base.transpose();
  const bool timed =
      s.options.latency_sigma_s > 0 &&
      std::any_of(s.crossings.begin(), s.crossings.end(), [](const Crossing& c) { return c.speed_mm_s > 0; });
  if (timed) result.latency_s = 1e-3 * s.fit.state.latency_ms;
  result.inset_mm = s.fit.state.inset_mm;
  for (const Rival& rival : s.rivals) {
    if (rival.gap_nats < kFarBehind_nats) {
      result.alternatives.push_back({part_pose(s.outline, rival.fit.state.pose), mean_distance(rival.fit)});
    }
  }
  fill_members(s, to_base, result);
}

void match_all(const Situation& s, std::span<const EdgePoint> edges, const std::vector<bool>& stray,
               Localization& result) {
  const double cos = std::cos(result.pose.theta_rad), sin = std::sin(result.pose.theta_rad);
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const Crossings one = ready_crossings(edges.subspan(i, 1), s.options.default_sigma_mm);
    if (one.list.empty() || (!stray.empty() && stray[i])) continue;
    const Match m = match(s.fields, one.list.front(), s.fit.state.pose, cos, sin);
    if (m.edge < 0) continue;
    result.residual_mm[i] = m.residual_mm;
    if (m.distance_mm <= 4 * s.fit.scale * one.list.front().sigma_mm) result.edge_of_point[i] = m.edge;
  }
}

/// Edge and residual of every point given, also of those that stood twice or were too many for the fit.
void fill_points(const Situation& s, std::span<const EdgePoint> edges, const std::vector<bool>& stray,
                 Localization& result) {
  result.points = static_cast<int>(edges.size());
  result.edge_of_point.assign(edges.size(), -1);
  result.residual_mm.assign(edges.size(), 0);
  if (s.crossings.size() < edges.size()) match_all(s, edges, stray, result);
  for (std::size_t i = 0; i < s.crossings.size(); ++i) {
    const auto source = static_cast<std::size_t>(s.crossings[i].source);
    result.edge_of_point[source] = s.fit.inlier[i] > 0.5 ? s.fit.matches[i].edge : -1;
    result.residual_mm[source] = s.fit.matches[i].edge >= 0 ? s.fit.matches[i].residual_mm : 0;
    result.inliers += s.fit.inlier[i] > 0.5;
  }
  result.mean_error_mm = mean_distance(s.fit);
}

}  // namespace

void describe(const Situation& s, std::span<const EdgePoint> edges, const std::vector<bool>& stray,
              Localization& result) {
  fill_pose(s, result);
  fill_points(s, edges, stray, result);
}

}  // namespace weldcell::localize
