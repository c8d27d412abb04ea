#include "decide.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>

#include "alternatives.hpp"
#include "chance.hpp"
#include "proof.hpp"
#include "weldcell/base/units.hpp"
#include "wording.hpp"
#include "wrong_part.hpp"

namespace weldcell::localize {

namespace {

constexpr double kMinInlierShare = 0.35;
constexpr double kMinRate = 0.5;
/// What a pose must be known to when no weld says so more exactly, and how likely it may be farther off:
/// asked for more, every third part of two members within its tolerance would be refused.
constexpr double kPoseBound_mm = 1.0;
constexpr double kPoseBound_rad = rad(0.2);
constexpr double kMostFartherOff = 0.09;
/// A pose with a longer tail than this (1 sigma) is not placed, however unlikely the tail.
constexpr double kMostSigma_mm = 0.75;
/// Where either of two members may be off: the unlikelier reading lies millimetres away.
constexpr double kMostSigmaOfEither_mm = 0.4;

/// What could be other than drawn without this scan having shown it.
bool not_looked_at(const Situation& s, const Alternatives& alternatives, Localization& result) {
  const std::vector<Unproven> open = unproven(s, alternatives);
  if (open.empty()) return false;
  for (const Unproven& u : open) {
    const auto m = static_cast<std::size_t>(u.departure.member);
    result.rescan.push_back({s.outline.member_names[m], u.pass.a, u.pass.b});
  }
  const Unproven& first = open.front();
  const std::string more =
      open.size() > 1 ? fmt::format(", and {} more line{}", open.size() - 1, open.size() > 2 ? "s" : "") : "";
  say(result, Verdict::Rescan, "not_looked_at",
      fmt::format("The {} was not looked at: it could be {} without the scan showing it. Scan across it "
                  "from ({:.0f}, {:.0f}) to ({:.0f}, {:.0f}) on the drawing{}.",
                  place_name(s.outline, first.departure),
                  first.departure.over ? "another" : "off by " + millimetres(s.options.prove_shift_mm),
                  first.pass.a.x(), first.pass.a.y(), first.pass.b.x(), first.pass.b.y(), more));
  return true;
}

/// The edge whose crossing would tell most about the worst known direction.
int most_telling_edge(const Situation& s, const Eigen::Matrix3d& covariance_part) {
  int best = 0;
  double gain = -1;
  for (std::size_t e = 0; e < s.fields.edges().size(); ++e) {
    const FieldEdge& edge = s.fields.edges()[e];
    const Vec2 middle = edge.a + 0.5 * edge.length_mm * edge.direction;
    const Vec2& n = edge.outward;
    const Eigen::Vector3d a(n.x(), n.y(), n.y() * middle.x() - n.x() * middle.y());
    const double here = a.dot(covariance_part * a) * std::min(1.0, edge.length_mm / 100);
    if (here <= gain) continue;
    gain = here;
    best = static_cast<int>(e);
  }
  return best;
}

bool too_vague(const Situation& s, Localization& result) {
  const Eigen::Matrix2d xy = result.covariance.topLeftCorner<2, 2>();
  const double largest = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(xy).eigenvalues()(1);
  const double sigma_rad = std::sqrt(result.covariance(2, 2));
  // Of two readings that lie apart the unlikelier one is not passed over.
  const double most_sigma = s.fit.either ? kMostSigmaOfEither_mm : kMostSigma_mm;
  // A covariance that rounding has left without a positive determinant proves nothing either.
  const bool proven = result.covariance.allFinite() && largest <= most_sigma * most_sigma &&
                      Eigen::LLT<Eigen::Matrix3d>(result.covariance).info() == Eigen::Success;
  const double bound_rad = std::max(kPoseBound_rad, 1.0 / std::max(s.outline.radius_mm, 1.0));
  if (proven && chance_beyond(s.fit.chances, kPoseBound_mm, bound_rad) <= kMostFartherOff) return false;
  if (const auto& either = s.fit.either) {
    say(result, Verdict::Rescan, "not_enough",
        fmt::format("{} or {} lies {} off its place on the drawing, and the scan does not tell which. Scan "
                    "across the joints of both, or set it right.",
                    member_name(s, either->first.member), member_name(s, either->second.member),
                    millimetres(either->apart_mm)));
    return true;
  }
  const int edge = most_telling_edge(s, s.fit.covariance.topLeftCorner<3, 3>());
  say(result, Verdict::Rescan, "not_enough",
      fmt::format("Not enough was seen to place the part (known to {} and {}). Scan across the {} again.",
                  millimetres(2 * std::sqrt(std::max(largest, 0.0))), degrees(2 * sigma_rad),
                  edge_name(s.outline, edge)));
  return true;
}

/// How many points may be there by chance, among those that tell about one direction: clutter meets an edge
/// now and then, and the search picks the place where it does so most. The travel speaks against most such
/// places.
std::size_t by_chance(const Situation& s, int inliers) {
  const std::size_t outliers = s.crossings.size() - static_cast<std::size_t>(inliers);
  return s.evidence.has_path ? 1 + outliers / 16 : 2 + outliers / 8;
}

/// Whether some direction of the pose (shift, or turn as the shift of the farthest point) hangs on points
/// that may be there by chance: without the most telling ones less than kMustRemain whole points tell about
/// it.
bool hangs_on_few(const Situation& s, Localization& result) {
  constexpr double kMustRemain = 2;
  const double radius = std::max(s.outline.radius_mm, 1.0);
  std::vector<Eigen::Vector3d> rows;
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < s.fit.matches.size(); ++i) {
    const Match& m = s.fit.matches[i];
    if (m.edge < 0 || s.fit.inlier[i] <= 0.5) continue;
    const Vec2& n = s.fields.edges()[static_cast<std::size_t>(m.edge)].outward;
    rows.emplace_back(n.x(), n.y(), (n.y() * m.place.x() - n.x() * m.place.y()) / radius);
    information += rows.back() * rows.back().transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(information);
  const std::size_t chance = std::min(by_chance(s, result.inliers), rows.size());
  for (int k = 0; k < 3; ++k) {
    std::vector<double> tells;
    tells.reserve(rows.size());
    for (const Eigen::Vector3d& row : rows) {
      const double along = row.dot(axes.eigenvectors().col(k));
      tells.push_back(along * along);
    }
    std::nth_element(tells.begin(), tells.begin() + static_cast<std::ptrdiff_t>(chance), tells.end(),
                     std::greater<>());
    if (std::accumulate(tells.begin() + static_cast<std::ptrdiff_t>(chance), tells.end(), 0.0) >= kMustRemain)
      continue;
    const Eigen::Vector3d open = axes.eigenvectors().col(k).cwiseProduct(Eigen::Vector3d(1, 1, 1 / radius));
    const int edge = most_telling_edge(s, open * open.transpose());
    say(result, Verdict::Rescan, "not_enough",
        fmt::format(
            "Too few points tell where the part lies in one direction, so that a stray one could shift "
            "it. Scan across the {} again.",
            edge_name(s.outline, edge)));
    return true;
  }
  return false;
}

bool ambiguous(const Situation& s, Localization& result) {
  for (const Rival& rival : s.rivals) {
    if (rival.gap_nats >= kAmbiguous_nats) continue;
    const double turn = wrap_pi(rival.fit.state.pose.theta_rad - s.fit.state.pose.theta_rad);
    const double off = (rival.fit.state.pose.centre - s.fit.state.pose.centre).norm();
    say(result, Verdict::Rescan, "ambiguous",
        fmt::format(
            "The part fits as well turned by {} and {} aside. Scan all members once more, or place it closer "
            "to the projected outline.",
            degrees(turn), millimetres(off)));
    return true;
  }
  return false;
}

bool out_of_range(const Situation& s, Localization& result) {
  if (within_limits(s, result.pose)) return false;
  const Offset off = offset_from_planned(s.outline, s.options.planned, result.pose);
  say(result, Verdict::Reject, "out_of_range",
      fmt::format("The part lies {} and {} away from its planned place; {} and {} are allowed. Move it to "
                  "the projected "
                  "outline and scan again.",
                  millimetres(std::hypot(off.dx_mm, off.dy_mm)), degrees(off.dtheta_rad),
                  millimetres(s.options.max_offset_mm), degrees(s.options.max_rotation_rad)));
  return true;
}

}  // namespace

double path_log_likelihood(const Evidence& evidence) {
  if (!evidence.has_path) return 0;
  // A crossing is missed with a chance of about one in twelve.
  return -2.5 * (evidence.expected - evidence.seen);
}

void decide(const Situation& s, Localization& result) {
  const auto total = static_cast<double>(s.crossings.size());
  std::optional<Alternatives> alternatives;
  if (s.options.full_reject_checks && s.evidence.has_path)
    alternatives.emplace(s.outline, s.crossings, s.path, s.fit, s.evidence);
  if (s.options.full_reject_checks && wrong_part(s, alternatives ? &*alternatives : nullptr, result)) return;
  if (result.inliers < kMinInlierShare * total || (s.evidence.has_path && s.evidence.rate < kMinRate)) {
    say(result, Verdict::Reject, "clutter",
        fmt::format("Only {} of {} edge points lie on the part as drawn. Clear the table of other things, "
                    "check that it "
                    "is part {}, and scan again.",
                    result.inliers, s.crossings.size(), s.outline.name));
    return;
  }
  if (too_vague(s, result) || hangs_on_few(s, result)) return;
  if (s.options.full_reject_checks && ambiguous(s, result)) return;
  if (out_of_range(s, result)) return;
  if (alternatives && s.options.prove_shift_mm > 0 && not_looked_at(s, *alternatives, result)) return;
  say(result, Verdict::Weld, "ok",
      fmt::format("The part was found with {} of {} edge points; its place is known to {} and {}.",
                  result.inliers, s.crossings.size(),
                  millimetres(2 * std::sqrt(std::max(result.covariance(0, 0), result.covariance(1, 1)))),
                  fmt::format("{:.3f} deg", deg(2 * std::sqrt(result.covariance(2, 2))))));
}

}  // namespace weldcell::localize
