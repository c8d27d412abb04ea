#include "evidence.hpp"

#include <algorithm>
#include <cmath>

namespace weldcell::localize {

namespace {

constexpr double kMinAcross = 0.35;  ///< |travel . normal| below which a crossing may be missed
constexpr double kEndMargin_mm = 5;
constexpr double kSameCrossing_mm = 9;
constexpr double kSeenAside_mm = 2;

struct Piece {
  Vec2 from, to;
};

std::vector<Piece> in_part(std::span<const PathPiece> path, const CentredPose& pose) {
  const double c = std::cos(pose.theta_rad), s = std::sin(pose.theta_rad);
  const auto place = [&](double x, double y) {
    const double dx = x - pose.centre.x(), dy = y - pose.centre.y();
    return Vec2(c * dx + s * dy, -s * dx + c * dy);
  };
  std::vector<Piece> out;
  out.reserve(path.size());
  for (const PathPiece& p : path) {
    out.push_back({place(p.x0_mm, p.y0_mm), place(p.x1_mm, p.y1_mm)});
  }
  return out;
}

/// Where a piece crosses an edge at a good angle, mm from the edge's start; negative when it does not.
double crossing_along(const Piece& piece, const FieldEdge& edge, const Vec2& shift) {
  const Vec2 a = piece.from - edge.a - shift, b = piece.to - edge.a - shift;
  const double from = a.dot(edge.outward), to = b.dot(edge.outward);
  if ((from < 0) == (to < 0)) return -1;
  const double share = from / (from - to);
  const double along = a.dot(edge.direction) + share * (b - a).dot(edge.direction);
  if (along < kEndMargin_mm || along > edge.length_mm - kEndMargin_mm) return -1;
  if (std::abs(to - from) < kMinAcross * (piece.to - piece.from).norm()) return -1;
  return along;
}

double binomial_tail(int seen, int expected, double p) {
  double term = std::pow(1 - p, expected), sum = term;
  for (int i = 1; i <= seen; ++i) {
    term *= p / (1 - p) * (expected - i + 1) / i;
    sum += term;
  }
  return sum;
}

}  // namespace

Evidence gather_evidence(const TemplateFields& fields, std::span<const PathPiece> path, const Fit& fit) {
  Evidence out;
  out.members.resize(fields.member_centroids().size());
  out.has_path = !path.empty();
  if (!out.has_path) return out;
  std::vector<std::vector<double>> seen_at(fields.edges().size());
  for (std::size_t i = 0; i < fit.matches.size(); ++i) {
    // A crossing that noise threw some sigmas off was seen all the same.
    if (fit.matches[i].edge < 0 || (fit.inlier[i] < 0.3 && std::abs(fit.residuals[i]) > kSeenAside_mm))
      continue;
    const FieldEdge& edge = fields.edges()[static_cast<std::size_t>(fit.matches[i].edge)];
    seen_at[static_cast<std::size_t>(fit.matches[i].edge)].push_back(
        (fit.matches[i].place - edge.a).dot(edge.direction));
  }
  for (const Piece& piece : in_part(path, fit.state.pose)) {
    const Vec2 middle = 0.5 * (piece.from + piece.to);
    const double half = 0.5 * (piece.to - piece.from).norm();
    if (half < 20 && fields.clearance_mm(middle) > half) continue;
    const Vec2 low = piece.from.cwiseMin(piece.to), high = piece.from.cwiseMax(piece.to);
    for (std::size_t e = 0; e < fields.edges().size(); ++e) {
      const FieldEdge& edge = fields.edges()[e];
      const Vec2 end = edge.a + edge.length_mm * edge.direction;
      if (std::max(edge.a.x(), end.x()) < low.x() || std::min(edge.a.x(), end.x()) > high.x() ||
          std::max(edge.a.y(), end.y()) < low.y() || std::min(edge.a.y(), end.y()) > high.y()) {
        continue;
      }
      const double along = crossing_along(piece, edge, Vec2::Zero());
      if (along < 0) continue;
      const bool seen = std::any_of(seen_at[e].begin(), seen_at[e].end(),
                                    [&](double at) { return std::abs(at - along) <= kSameCrossing_mm; });
      out.crossings.push_back({static_cast<int>(e), along, seen});
      MemberEvidence& member = out.members[static_cast<std::size_t>(edge.member)];
      ++member.expected;
      member.seen += seen;
    }
  }
  int expected = 0, seen = 0;
  for (const MemberEvidence& m : out.members) {
    out.expected += m.expected;
    out.seen += m.seen;
    if (m.seen == 0) continue;
    expected += m.expected;
    seen += m.seen;
  }
  out.rate = (seen + 1.0) / (expected + 1.0);
  return out;
}

std::vector<int> unseen_members(const Evidence& evidence) {
  std::vector<int> out;
  for (std::size_t i = 0; i < evidence.members.size(); ++i) {
    const MemberEvidence& m = evidence.members[i];
    if (m.expected < 3 || m.seen > 0.35 * m.expected) continue;
    const int expected = evidence.expected - m.expected, seen = evidence.seen - m.seen;
    const double rate = std::clamp(0.95 * (seen + 1.0) / (expected + 1.0), 0.05, 0.97);
    if (binomial_tail(m.seen, m.expected, rate) < 1e-4) out.push_back(static_cast<int>(i));
  }
  return out;
}

}  // namespace weldcell::localize
