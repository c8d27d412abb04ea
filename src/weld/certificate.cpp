#include "weldcell/weld/certificate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "joint.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::weld {

namespace {

using localize::Localization;
using localize::Verdict;
using workpiece::Member;
using workpiece::Weld;
using workpiece::Workpiece;

/// A member as the localization places it: its displacement is linear in the place where one asks.
struct Placed {
  const Member* member = nullptr;
  Vec2 centre = Vec2::Zero();  // the member's centroid in Base
  Vec2 shift = Vec2::Zero();
  double turn_rad = 0;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();

  Vec2 displacement(const Vec2& p) const {
    const Vec2 r = p - centre;
    return shift + turn_rad * Vec2(-r.y(), r.x());
  }
};

/// Variance along unit n, at p, of a small motion (x, y, theta) stated about c.
double variance_along(const Eigen::Matrix3d& covariance, const Vec2& c, const Vec2& p, const Vec2& n) {
  const Vec2 r = p - c;
  const Eigen::Vector3d g(n.x(), n.y(), n.dot(Vec2(-r.y(), r.x())));
  return std::max(0.0, g.dot(covariance * g));
}

Placed place(const Workpiece& workpiece, const Localization& found, const std::string& name,
             const CertifyOptions& options) {
  Placed out;
  for (const Member& m : workpiece.members) {
    if (m.name == name) out.member = &m;
  }
  if (!out.member) return out;
  out.centre = found.pose * centroid(out.member->outline);
  for (const localize::MemberPose& pose : found.members) {
    if (pose.name != name) continue;
    out.shift = {pose.dx_mm, pose.dy_mm};
    out.turn_rad = pose.dtheta_rad;
    out.covariance = pose.covariance;
    return out;
  }
  // A pose without any spread is assumed, not measured: then the members are taken as drawn too.
  if (found.members.empty() && found.covariance.isZero(0)) return out;
  const double s = options.unmeasured_shift_sigma_mm, t = options.unmeasured_angle_sigma_rad;
  out.covariance = Eigen::Vector3d(s * s, s * s, t * t).asDiagonal();
  return out;
}

Vec2 mean_displacement(const std::vector<Placed>& joined, const Vec2& p) {
  Vec2 sum = Vec2::Zero();
  for (const Placed& m : joined) sum += m.displacement(p);
  return joined.empty() ? sum : Vec2(sum / static_cast<double>(joined.size()));
}

/// Horizontal unit normal of the path at k; a vertical stretch has none.
bool lateral(const std::vector<Eigen::Vector3d>& path, std::size_t k, Vec2& normal) {
  const Eigen::Vector3d t = path[std::min(k + 1, path.size() - 1)] - path[k == 0 ? 0 : k - 1];
  const Vec2 flat = t.head<2>();
  if (flat.norm() < 1e-3 * t.norm() || flat.norm() < 1e-9) return false;
  normal = Vec2(-flat.y(), flat.x()).normalized();
  return true;
}

struct Spread {
  double sigma_mm = 0;
  std::string weakest;
};

Spread spread_along(const Localization& found, const std::vector<Placed>& joined, const Vec2& p,
                    const Vec2& n, double robot_sigma_mm) {
  const double robot = robot_sigma_mm * robot_sigma_mm;
  double total = robot, largest = robot;
  Spread out{0, "robot"};
  const auto add = [&](double variance, const std::string& name) {
    total += variance;
    if (variance > largest) {
      largest = variance;
      out.weakest = name;
    }
  };
  add(variance_along(found.covariance, found.centroid_base, p, n), "part");
  const double share = joined.empty() ? 0 : 1.0 / static_cast<double>(joined.size() * joined.size());
  for (const Placed& m : joined) add(share * variance_along(m.covariance, m.centre, p, n), m.member->name);
  out.sigma_mm = std::sqrt(total);
  return out;
}

void bound_over_path(const Localization& found, const std::vector<Placed>& joined,
                     const CertifyOptions& options, WeldCertificate& out) {
  out.worst = out.path.front();
  for (std::size_t k = 0; k < out.path.size(); ++k) {
    const Vec2 p = out.path[k].head<2>();
    Vec2 n;
    std::vector<Vec2> directions;
    if (lateral(out.path, k, n)) {
      directions = {n};
    } else {
      // A vertical stretch can be missed in any direction of the plane.
      for (int i = 0; i < 12; ++i) directions.push_back({std::cos(i * kPi / 12), std::sin(i * kPi / 12)});
    }
    for (const Vec2& d : directions) {
      const Spread spread = spread_along(found, joined, p, d, options.robot_sigma_mm);
      const double bound = std::abs(options.bias_mm) + kSigmas95 * spread.sigma_mm;
      if (bound <= out.bound_mm) continue;
      out.bound_mm = bound;
      out.sigma_mm = spread.sigma_mm;
      out.worst = out.path[k];
      out.weakest = spread.weakest;
    }
  }
}

struct Opening {
  double gap_mm = 0, sigma_mm = 0;
  std::string first, second;
};

/// The widest opening between any two of the joined members along their joint; of an overlap the least.
Opening widest_opening(const Localization& found, const std::vector<Placed>& joined,
                       const std::vector<Eigen::Vector3d>& path) {
  Opening widest;
  bool any = false;
  const Vec2 middle = found.pose.inverse() * Vec2(path[path.size() / 2].head<2>());
  for (std::size_t a = 0; a < joined.size(); ++a) {
    for (std::size_t b = a + 1; b < joined.size(); ++b) {
      const auto touch = contact(*joined[a].member, *joined[b].member, middle);
      if (!touch) continue;
      const Vec2 n = found.pose.rotate(touch->normal);
      for (const Vec2& end : {found.pose * touch->line.a, found.pose * touch->line.b}) {
        const double gap = n.dot(joined[b].displacement(end) - joined[a].displacement(end));
        if (any && gap <= widest.gap_mm) continue;
        any = true;
        const double variance = variance_along(joined[a].covariance, joined[a].centre, end, n) +
                                variance_along(joined[b].covariance, joined[b].centre, end, n);
        widest = {gap, std::sqrt(variance), joined[a].member->name, joined[b].member->name};
      }
    }
  }
  return widest;
}

struct Stray {
  double mm = 0;
  std::string member;
};

Stray largest_displacement(const std::vector<Placed>& joined, const std::vector<Eigen::Vector3d>& path) {
  Stray out;
  for (const Placed& m : joined) {
    for (const Eigen::Vector3d& p : {path.front(), path.back()}) {
      const double d = m.displacement(p.head<2>()).norm();
      if (d > out.mm) out = {d, m.member->name};
    }
  }
  return out;
}

/// Which sides of a member a further scan should cross to tighten the place along n.
std::string sides_to_scan(const Placed& m, const Pose2& pose, const Vec2& n) {
  double along_n = 0, across_n = 0;
  const Polygon& o = m.member->outline;
  for (std::size_t i = 0; i < o.size(); ++i) {
    const Vec2 side = pose.rotate(o[(i + 1) % o.size()] - o[i]);
    along_n += std::abs(side.dot(n));
    across_n += std::abs(side.dot(Vec2(-n.y(), n.x())));
  }
  return across_n >= along_n ? "long sides" : "ends";
}

void judge(const Localization& found, const std::vector<Placed>& joined, const CertifyOptions& options,
           WeldCertificate& out) {
  const Opening opening = widest_opening(found, joined, out.path);
  out.gap_mm = opening.gap_mm;
  out.gap_sigma_mm = opening.sigma_mm;
  const double floor = std::abs(options.bias_mm) + kSigmas95 * options.robot_sigma_mm;
  const Stray stray = largest_displacement(joined, out.path);
  const auto settle = [&](Verdict verdict, std::string reason) {
    out.verdict = verdict;
    out.reason = std::move(reason);
  };

  if (stray.mm > options.max_member_shift_mm) {
    return settle(
        Verdict::Reject,
        fmt::format("weld {}: {} lies {:.1f} mm beside the drawing, {:.1f} mm are allowed: move it, or "
                    "check that the drawing is the right one",
                    out.name, stray.member, stray.mm, options.max_member_shift_mm));
  }
  if (std::abs(out.gap_mm) > options.max_gap_mm) {
    const std::string size = out.gap_mm > 0
                                 ? fmt::format("the gap between {} and {} is {:.2f} mm wider than drawn",
                                               opening.first, opening.second, out.gap_mm)
                                 : fmt::format("{} and {} overlap by {:.2f} mm, which steel cannot",
                                               opening.first, opening.second, -out.gap_mm);
    // A gap that the spread alone could make is no reason to take the part apart.
    if (std::abs(out.gap_mm) - kSigmas95 * out.gap_sigma_mm <= options.max_gap_mm) {
      return settle(
          Verdict::Rescan,
          fmt::format("weld {}: {} (+-{:.2f}), {:.2f} mm are allowed: scan {} and {} again", out.name, size,
                      kSigmas95 * out.gap_sigma_mm, options.max_gap_mm, opening.first, opening.second));
    }
    return settle(Verdict::Reject,
                  fmt::format("weld {}: {}, {:.2f} mm are allowed: {}", out.name, size, options.max_gap_mm,
                              out.gap_mm > 0 ? "close the joint or weld it manually"
                                             : "a member is longer than drawn, measure it"));
  }
  if (out.bound_mm <= out.tolerance_mm) {
    return settle(Verdict::Weld, fmt::format("weld {}: within {:.2f} mm of the joint, {:.2f} mm are allowed",
                                             out.name, out.bound_mm, out.tolerance_mm));
  }
  if (floor >= out.tolerance_mm) {
    return settle(
        Verdict::Reject,
        fmt::format("weld {}: the robot itself holds +-{:.2f} mm, the drawing asks for {:.2f} mm: weld it "
                    "manually, or widen the tolerance",
                    out.name, floor, out.tolerance_mm));
  }
  std::string where = "every member once more, in both directions";
  for (const Placed& m : joined) {
    if (m.member->name != out.weakest) continue;
    const auto worst = std::find(out.path.begin(), out.path.end(), out.worst);
    Vec2 n = Vec2::UnitX();
    lateral(out.path, static_cast<std::size_t>(worst - out.path.begin()), n);
    where = fmt::format("the {} of {} again", sides_to_scan(m, found.pose, n), m.member->name);
  }
  settle(Verdict::Rescan,
         fmt::format("weld {}: its place is known to +-{:.2f} mm only, {:.2f} mm are needed: scan {}",
                     out.name, out.bound_mm, out.tolerance_mm, where));
}

int gravity(Verdict v) { return v == Verdict::Reject ? 2 : v == Verdict::Rescan ? 1 : 0; }

bool finite(const Localization& found) {
  bool all = found.covariance.allFinite() && std::isfinite(found.pose.x_mm) &&
             std::isfinite(found.pose.y_mm) && std::isfinite(found.pose.theta_rad) &&
             found.centroid_base.allFinite();
  for (const localize::MemberPose& m : found.members) {
    all = all && m.covariance.allFinite() && std::isfinite(m.dx_mm) && std::isfinite(m.dy_mm) &&
          std::isfinite(m.dtheta_rad);
  }
  return all;
}

/// Height of the part's upper surface at a place, Base.
double top_at(const Workpiece& workpiece, const Vec2& place, const CertifyOptions& options) {
  return options.top ? options.top->plane.at(place, options.top->reference)
                     : options.table_z_mm + workpiece.height_mm;
}

/// How far the measured top lies from where table and drawing put it, at the seam's worst point.
double height_off(const Workpiece& workpiece, const WeldCertificate& weld, const CertifyOptions& options) {
  double worst = 0;
  for (const Eigen::Vector3d& p : weld.path) {
    const double off = top_at(workpiece, p.head<2>(), options) - options.table_z_mm - workpiece.height_mm;
    if (std::abs(off) > std::abs(worst)) worst = off;
  }
  return worst;
}

WeldCertificate certify_one(const Workpiece& workpiece, const Weld& weld, const Localization& found,
                            const CertifyOptions& options) {
  WeldCertificate out;
  out.name = weld.name;
  out.tolerance_mm = weld.tolerance_mm;
  if (found.verdict == Verdict::Reject || !finite(found)) {
    out.reason = fmt::format("weld {}: not placed: {}", weld.name,
                             found.reason.empty() ? "the part was not found" : found.reason);
    return out;
  }
  std::vector<Placed> joined;
  for (const std::string& name : weld.joins) {
    const Placed m = place(workpiece, found, name, options);
    if (m.member) joined.push_back(m);
  }
  for (const Eigen::Vector3d& p : workpiece::sample_path(weld, kPathStepMm)) {
    const Vec2 planned = found.pose * Vec2(p.head<2>());
    const Vec2 seam = planned + mean_displacement(joined, planned);
    const double below_top = workpiece.height_mm - p.z();
    out.path.push_back({seam.x(), seam.y(), top_at(workpiece, seam, options) - below_top});
  }
  if (out.path.size() < 2) {
    out.path.clear();
    out.reason = fmt::format("weld {}: its path has no length: correct the drawing", weld.name);
    return out;
  }
  bound_over_path(found, joined, options, out);
  judge(found, joined, options, out);
  if (const double off = height_off(workpiece, out, options); std::abs(off) > options.max_height_off_mm) {
    out.verdict = Verdict::Reject;
    out.reason = fmt::format(
        "weld {}: the part's top lies {:.1f} mm {} where table and drawing put it: clear what lies under the "
        "part, or "
        "calibrate the table",
        out.name, std::abs(off), off > 0 ? "above" : "below");
  }
  if (gravity(found.verdict) > gravity(out.verdict)) {
    out.verdict = found.verdict;
    out.reason = fmt::format("weld {}: waits for a further scan: {}", weld.name, found.reason);
  }
  return out;
}

}  // namespace

std::vector<WeldCertificate> certify(const Workpiece& workpiece, const Localization& found,
                                     const CertifyOptions& options) {
  std::vector<WeldCertificate> out;
  out.reserve(workpiece.welds.size());
  for (const Weld& weld : workpiece.welds) out.push_back(certify_one(workpiece, weld, found, options));
  return out;
}

std::vector<WeldCertificate> assume_exact(const Workpiece& workpiece, const Pose2& pose,
                                          const CertifyOptions& options) {
  Localization exact;
  exact.verdict = Verdict::Weld;
  exact.cause = "assumed";
  exact.pose = pose;
  exact.centroid_base = pose.translation();
  return certify(workpiece, exact, options);
}

JobVerdict decide(const Localization& found, const std::vector<WeldCertificate>& certificates) {
  JobVerdict out{found.verdict, found.reason};
  for (const WeldCertificate& c : certificates) {
    if (gravity(c.verdict) > gravity(out.verdict)) out = {c.verdict, c.reason};
  }
  if (out.verdict != Verdict::Weld) return out;
  if (certificates.empty()) {
    out.reason = "the part is found; the drawing has no welds";
    return out;
  }
  const auto tightest = std::min_element(
      certificates.begin(), certificates.end(),
      [](const auto& a, const auto& b) { return a.tolerance_mm - a.bound_mm < b.tolerance_mm - b.bound_mm; });
  out.reason = fmt::format(
      "{} of {} welds are inside their tolerance; the tightest is {}: {:.2f} of {:.2f} mm",
      certificates.size(), certificates.size(), tightest->name, tightest->bound_mm, tightest->tolerance_mm);
  return out;
}

}  // namespace weldcell::weld
