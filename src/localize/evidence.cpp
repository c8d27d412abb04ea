#include "evidence.hpp"

#include <algorithm>
#include <cmath>

namespace weldcell::localize {

namespace {

constexpr double kMinAcross = 0.35;  ///< |travel . normal| below which a crossing may be missed
constexpr double kEndMargin_mm = 5;
constexpr double kSameCrossing_mm = 9;
constexpr double kExplained_mm = 1.5;
/// Nats for a point explained and for an expected crossing not seen.
constexpr double kPointNats = 5, kUnseenNats = 3;

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
    if (!std::isfinite(p.x0_mm + p.y0_mm + p.x1_mm + p.y1_mm)) continue;
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
    if (fit.inlier[i] < 0.3) continue;
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

namespace {

/// How well one member, shifted, explains the points that no other member claims and the path over it.
class MemberView {
 public:
  MemberView(const TemplateFields& fields, std::span<const PathPiece> path,
             const std::vector<Crossing>& crossings, const Fit& fit, int member)
      : fit_(fit) {
    Vec2 low = Vec2::Constant(1e300), high = Vec2::Constant(-1e300);
    for (const FieldEdge& edge : fields.edges()) {
      if (edge.member != member) continue;
      edges_.push_back(edge);
      const Vec2 end = edge.a + edge.length_mm * edge.direction;
      low = low.cwiseMin(edge.a).cwiseMin(end);
      high = high.cwiseMax(edge.a).cwiseMax(end);
    }
    const Vec2 margin = Vec2::Constant(kDisplacement_mm + 5);
    low -= margin;
    high += margin;
    const double c = std::cos(fit.state.pose.theta_rad), s = std::sin(fit.state.pose.theta_rad);
    for (std::size_t i = 0; i < crossings.size(); ++i) {
      const Match& m = fit.matches[i];
      const bool claimed =
          fit.inlier[i] > 0.3 && fields.edges()[static_cast<std::size_t>(m.edge)].member != member;
      if (claimed || (m.place.array() < low.array()).any() || (m.place.array() > high.array()).any())
        continue;
      const Vec2& inward = crossings[i].inward;
      points_.push_back({m.place, Vec2(c * inward.x() + s * inward.y(), -s * inward.x() + c * inward.y())});
    }
    for (const Piece& piece : in_part(path, fit.state.pose)) {
      const Vec2 a = piece.from.cwiseMin(piece.to), b = piece.from.cwiseMax(piece.to);
      if ((b.array() < low.array()).any() || (a.array() > high.array()).any()) continue;
      pieces_.push_back(piece);
    }
  }

  int explained(const Vec2& shift) const {
    int count = 0;
    for (const Point& p : points_) count += fits(p, shift);
    return count;
  }

  /// Nats: points explained less crossings that should be there and are not.
  double score(const Vec2& shift) const {
    int unseen = 0;
    for (const FieldEdge& edge : edges_) {
      std::vector<double> seen_at;
      for (const Point& p : points_) {
        if (fits_edge(p, edge, shift)) seen_at.push_back((p.place - edge.a - shift).dot(edge.direction));
      }
      for (const Piece& piece : pieces_) {
        const double along = crossing_along(piece, edge, shift);
        if (along < 0) continue;
        unseen += std::none_of(seen_at.begin(), seen_at.end(),
                               [&](double at) { return std::abs(at - along) <= kSameCrossing_mm; });
      }
    }
    return kPointNats * explained(shift) - kUnseenNats * unseen;
  }

 private:
  struct Point {
    Vec2 place, inward;
  };
  static bool fits_edge(const Point& p, const FieldEdge& edge, const Vec2& shift) {
    const Vec2 from = p.place - edge.a - shift;
    const double along = from.dot(edge.direction);
    return std::abs(from.dot(edge.outward)) <= kExplained_mm && along >= -kExplained_mm &&
           along <= edge.length_mm + kExplained_mm && p.inward.dot(edge.outward) <= 0;
  }
  bool fits(const Point& p, const Vec2& shift) const {
    return std::any_of(edges_.begin(), edges_.end(),
                       [&](const FieldEdge& e) { return fits_edge(p, e, shift); });
  }

  const Fit& fit_;
  std::vector<FieldEdge> edges_;
  std::vector<Point> points_;
  std::vector<Piece> pieces_;
};

}  // namespace

Displacement find_displacement(const TemplateFields& fields, std::span<const PathPiece> path,
                               const std::vector<Crossing>& crossings, const Fit& fit, const Evidence&,
                               int member) {
  const MemberView view(fields, path, crossings, fit, member);
  struct Candidate {
    Vec2 shift;
    int explained;
  };
  std::vector<Candidate> candidates;
  constexpr int kSteps = static_cast<int>(kDisplacement_mm / 2);
  for (int ix = -kSteps; ix <= kSteps; ++ix) {
    for (int iy = -kSteps; iy <= kSteps; ++iy) {
      const Vec2 shift(2.0 * ix, 2.0 * iy);
      if (shift.norm() < 4) continue;
      candidates.push_back({shift, view.explained(shift)});
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    if (a.explained != b.explained) return a.explained > b.explained;
    return a.shift.squaredNorm() < b.shift.squaredNorm();
  });
  Displacement best;
  best.member = member;
  best.gain = -1e300;
  const double here = view.score(Vec2::Zero());
  for (std::size_t i = 0; i < std::min<std::size_t>(candidates.size(), 40); ++i) {
    const double gain = view.score(candidates[i].shift) - here;
    if (gain > best.gain) best = {member, candidates[i].shift, candidates[i].explained, gain};
  }
  return best;
}

}  // namespace weldcell::localize
