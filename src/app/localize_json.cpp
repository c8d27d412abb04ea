#include "app/localize_json.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "weldcell/base/units.hpp"

namespace weldcell::app {

namespace {

using nlohmann::json;

json alternatives_json(const localize::Localization& found) {
  json out = json::array();
  for (const localize::Alternative& a : found.alternatives) {
    out.push_back({{"x_mm", a.pose.x_mm},
                   {"y_mm", a.pose.y_mm},
                   {"theta_deg", deg(a.pose.theta_rad)},
                   {"mean_error_mm", a.mean_error_mm}});
  }
  return out;
}

json rescan_json(const localize::Localization& found) {
  json out = json::array();
  for (const localize::ScanLine& line : found.rescan) {
    out.push_back({{"member", line.member},
                   {"from_mm", {line.from.x(), line.from.y()}},
                   {"to_mm", {line.to.x(), line.to.y()}}});
  }
  return out;
}

double sigma(double variance) { return std::sqrt(std::max(variance, 0.0)); }

/// Covariance and sigmas; null where none was estimated: a zero would claim that the place is known exactly.
void add_uncertainty(const localize::Localization& found, json& out) {
  for (const char* key : {"covariance_mm_rad", "centroid_sigma_mm", "theta_sigma_deg"}) out[key] = json();
  if (found.covariance.isZero(0)) return;
  json covariance = json::array();
  for (int i = 0; i < 3; ++i) {
    covariance.push_back({found.covariance(i, 0), found.covariance(i, 1), found.covariance(i, 2)});
  }
  out["covariance_mm_rad"] = covariance;
  out["centroid_sigma_mm"] = {sigma(found.covariance(0, 0)), sigma(found.covariance(1, 1))};
  out["theta_sigma_deg"] = deg(sigma(found.covariance(2, 2)));
}

}  // namespace

nlohmann::json members_json(const localize::Localization& found) {
  json out = json::array();
  for (const localize::MemberPose& m : found.members) {
    out.push_back({{"name", m.name},
                   {"dx_mm", m.dx_mm},
                   {"dy_mm", m.dy_mm},
                   {"dtheta_deg", deg(m.dtheta_rad)},
                   {"sigma_mm", m.sigma_mm},
                   {"points", m.points}});
  }
  return out;
}

nlohmann::json welds_json(const std::vector<weld::WeldCertificate>& certificates) {
  json out = json::array();
  for (const weld::WeldCertificate& c : certificates) {
    out.push_back({{"name", c.name},
                   {"bound_mm", c.bound_mm},
                   {"tolerance_mm", c.tolerance_mm},
                   {"verdict", localize::to_string(c.verdict)},
                   {"gap_mm", c.gap_mm},
                   {"reason", c.reason}});
  }
  return out;
}

nlohmann::json plane_json(const std::optional<localize::TiltedPlane>& plane) {
  if (!plane) return {};
  const Eigen::Matrix3d& c = plane->covariance;
  return {{"z_mm", plane->z_mm},
          {"z_sigma_mm", sigma(c(0, 0))},
          {"roll_deg", deg(plane->slope_y)},
          {"roll_sigma_deg", deg(sigma(c(2, 2)))},
          {"pitch_deg", deg(-plane->slope_x)},
          {"pitch_sigma_deg", deg(sigma(c(1, 1)))},
          {"points", plane->points},
          {"rms_mm", plane->rms_mm}};
}

nlohmann::json localize_json(const workpiece::OutlineTemplate& outline, const Pose2& planned,
                             const localize::Localization& found,
                             const std::vector<weld::WeldCertificate>& certificates, double seconds) {
  const weld::JobVerdict verdict = weld::decide(found, certificates);
  const localize::Offset offset = localize::offset_from_planned(outline, planned, found.pose);
  json out = {
      {"verdict", localize::to_string(verdict.verdict)},
      {"accepted", verdict.verdict == localize::Verdict::Weld},
      {"cause", found.cause},
      {"reason", verdict.reason},
      {"x_mm", found.pose.x_mm},
      {"y_mm", found.pose.y_mm},
      {"theta_deg", deg(found.pose.theta_rad)},
      {"offset", {{"dx_mm", offset.dx_mm}, {"dy_mm", offset.dy_mm}, {"dtheta_deg", deg(offset.dtheta_rad)}}},
      {"mean_error_mm", found.mean_error_mm},
      {"points", found.points},
      {"inliers", found.inliers},
      {"latency_ms", found.latency_s ? json(1e3 * *found.latency_s) : json()},
      {"inset_mm", found.inset_mm},
      {"alternatives", alternatives_json(found)},
      {"members", members_json(found)},
      {"rescan", rescan_json(found)},
      {"welds", welds_json(certificates)},
      {"seconds", seconds}};
  add_uncertainty(found, out);
  return out;
}

}  // namespace weldcell::app
