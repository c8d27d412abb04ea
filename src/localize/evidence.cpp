#include "evidence.hpp"

#include <algorithm>
#include <cmath>

namespace weldcell::localize {

namespace {

constexpr double kMinAcross = 0.35;  ///< |travel . normal| below which a crossing may be missed
constexpr double kEndMargin_mm = 5;
constexpr double kSameCrossing_mm = 9;
constexpr double kExplained_mm = 1.5;
constexpr double kSeenAside_mm = 2;
/// Members a little off shift the ends of what a joint hides.
constexpr double kInsideJoint_mm = 4;

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

namespace {

/// The member that hides a point of a side, well inside the joint; -1 when none does.
int hidden_by(const workpiece::OutlineTemplate& outline, int owner, const Vec2& p, const Vec2& direction,
              const Vec2& outward) {
  for (std::size_t m = 0; m < outline.members.size(); ++m) {
    if (static_cast<int>(m) == owner) continue;
    const auto covers = [&](double along) {
      const Vec2 q = p + along * direction;
      return contains(outline.members[m], q + kExplained_mm * outward) || contains(outline.members[m], q);
    };
    if (covers(0) && covers(kInsideJoint_mm) && covers(-kInsideJoint_mm)) return static_cast<int>(m);
  }
  return -1;
}

double hidden_length(const workpiece::OutlineTemplate& outline) {
  double all = 0, visible = 0;
  for (const Polygon& m : outline.members) {
    for (std::size_t i = 0; i < m.size(); ++i) all += (m[(i + 1) % m.size()] - m[i]).norm();
  }
  for (const workpiece::VisibleEdge& e : outline.edges) visible += e.line.length();
  return std::max(0.0, all - visible);
}

/// Area that the points span, for the density of clutter; mm2.
double spanned_area(const std::vector<Crossing>& crossings) {
  Vec2 low = Vec2::Constant(1e300), high = Vec2::Constant(-1e300);
  for (const Crossing& c : crossings) {
    low = low.cwiseMin(c.point);
    high = high.cwiseMax(c.point);
  }
  return std::max(1e4, (high - low).prod());
}

int clutter_count(const Fit& fit) {
  return static_cast<int>(
      std::count_if(fit.inlier.begin(), fit.inlier.end(), [](double p) { return p < 0.5; }));
}

}  // namespace

void add_exposed(const workpiece::OutlineTemplate& outline, const std::vector<Crossing>& crossings,
                 const Fit& fit, Evidence& evidence) {
  evidence.hides.assign(crossings.size(), -1);
  const double c = std::cos(fit.state.pose.theta_rad), s = std::sin(fit.state.pose.theta_rad);
  for (std::size_t i = 0; i < crossings.size(); ++i) {
    if (fit.inlier[i] > 0.3) continue;
    const Vec2 p = fit.matches[i].place + outline.centroid;
    const Vec2& in = crossings[i].inward;
    const Vec2 inward(c * in.x() + s * in.y(), -s * in.x() + c * in.y());
    for (std::size_t m = 0; m < outline.members.size() && evidence.hides[i] < 0; ++m) {
      const Polygon& polygon = outline.members[m];
      for (std::size_t k = 0; k < polygon.size(); ++k) {
        const Segment side{polygon[k], polygon[(k + 1) % polygon.size()]};
        const Vec2 d = side.direction(), outward(d.y(), -d.x());
        if (distance(p, side) > kExplained_mm || inward.dot(outward) > -0.5) continue;
        const int by = hidden_by(outline, static_cast<int>(m), p, d, outward);
        if (by >= 0) evidence.hides[i] = by;
      }
    }
    if (evidence.hides[i] < 0) continue;
    ++evidence.members[static_cast<std::size_t>(evidence.hides[i])].exposed;
    ++evidence.exposed;
  }
  // A third of the clutter travels steeply enough across the side, and with the right sign.
  evidence.exposed_by_chance =
      clutter_count(fit) / 3.0 * hidden_length(outline) * 2 * kExplained_mm / spanned_area(crossings);
}

namespace {

/// How well one member, shifted, explains the points that no other member claims and the path over it.
class MemberView {
 public:
  MemberView(const workpiece::OutlineTemplate& outline, const TemplateFields& fields,
             std::span<const PathPiece> path, const std::vector<Crossing>& crossings, const Fit& fit,
             const Evidence& evidence, int member) {
    const Polygon& polygon = outline.members[static_cast<std::size_t>(member)];
    Vec2 low = Vec2::Constant(1e300), high = Vec2::Constant(-1e300);
    double length = 0;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const Vec2 a = polygon[k] - outline.centroid, b = polygon[(k + 1) % polygon.size()] - outline.centroid;
      const Vec2 d = (b - a).normalized();
      sides_.push_back({a, d, Vec2(d.y(), -d.x()), (b - a).norm(), member, false});
      low = low.cwiseMin(a);
      high = high.cwiseMax(a);
      length += (b - a).norm();
    }
    for (const FieldEdge& edge : fields.edges()) {
      if (edge.member == member) edges_.push_back(edge);
    }
    const Vec2 margin = Vec2::Constant(kDisplacement_mm + 5);
    low -= margin;
    high += margin;
    take_points(fields, crossings, fit, evidence, member, low, high);
    for (const Piece& piece : in_part(path, fit.state.pose)) {
      const Vec2 a = piece.from.cwiseMin(piece.to), b = piece.from.cwiseMax(piece.to);
      if ((b.array() < low.array()).any() || (a.array() > high.array()).any()) continue;
      pieces_.push_back(piece);
    }
    const double chance =
        0.5 * (clutter_count(fit) + 1) * length * 2 * kExplained_mm / spanned_area(crossings);
    point_nats_ = std::clamp(-std::log(chance), 2.0, 6.0);
    const MemberEvidence& own = evidence.members[static_cast<std::size_t>(member)];
    const int expected = evidence.expected - own.expected, missed = expected - (evidence.seen - own.seen);
    unseen_nats_ = std::clamp(-std::log((missed + 0.5) / (expected + 1.0)), 0.3, 5.0);
  }

  const std::vector<FieldEdge>& sides() const { return sides_; }

  int explained(const Vec2& shift) const {
    return static_cast<int>(std::count_if(points_.begin(), points_.end(),
                                          [&](const Point& p) { return fits(p, sides_, shift); }));
  }

  /// Nats at the drawn place: its points less its visible crossings that were not seen.
  double drawn() const {
    const auto here = std::count_if(points_.begin(), points_.end(),
                                    [&](const Point& p) { return fits(p, edges_, Vec2::Zero()); });
    return point_nats_ * static_cast<double>(here) - unseen_nats_ * unseen(Vec2::Zero());
  }
  /// The same at another place; joints that open there explain the points they expose.
  double shifted(const Vec2& shift) const {
    return point_nats_ * (explained(shift) + exposed_) - unseen_nats_ * unseen(shift);
  }

 private:
  struct Point {
    Vec2 place, inward;
  };

  void take_points(const TemplateFields& fields, const std::vector<Crossing>& crossings, const Fit& fit,
                   const Evidence& evidence, int member, const Vec2& low, const Vec2& high) {
    const double c = std::cos(fit.state.pose.theta_rad), s = std::sin(fit.state.pose.theta_rad);
    for (std::size_t i = 0; i < crossings.size(); ++i) {
      const Match& m = fit.matches[i];
      if (evidence.hides[i] >= 0) {
        exposed_ += evidence.hides[i] == member;
        continue;
      }
      const bool claimed =
          fit.inlier[i] > 0.3 && fields.edges()[static_cast<std::size_t>(m.edge)].member != member;
      if (claimed || (m.place.array() < low.array()).any() || (m.place.array() > high.array()).any())
        continue;
      const Vec2& inward = crossings[i].inward;
      points_.push_back({m.place, Vec2(c * inward.x() + s * inward.y(), -s * inward.x() + c * inward.y())});
    }
  }

  static bool fits_edge(const Point& p, const FieldEdge& edge, const Vec2& shift) {
    const Vec2 from = p.place - edge.a - shift;
    const double along = from.dot(edge.direction);
    return std::abs(from.dot(edge.outward)) <= kExplained_mm && along >= -kExplained_mm &&
           along <= edge.length_mm + kExplained_mm && p.inward.dot(edge.outward) <= 0;
  }
  static bool fits(const Point& p, const std::vector<FieldEdge>& edges, const Vec2& shift) {
    return std::any_of(edges.begin(), edges.end(),
                       [&](const FieldEdge& e) { return fits_edge(p, e, shift); });
  }

  int unseen(const Vec2& shift) const {
    int count = 0;
    for (const FieldEdge& edge : edges_) {
      std::vector<double> seen_at;
      for (const Point& p : points_) {
        if (fits_edge(p, edge, shift)) seen_at.push_back((p.place - edge.a - shift).dot(edge.direction));
      }
      for (const Piece& piece : pieces_) {
        const double along = crossing_along(piece, edge, shift);
        if (along < 0) continue;
        count += std::none_of(seen_at.begin(), seen_at.end(),
                              [&](double at) { return std::abs(at - along) <= kSameCrossing_mm; });
      }
    }
    return count;
  }

  std::vector<FieldEdge> sides_, edges_;
  std::vector<Point> points_;
  std::vector<Piece> pieces_;
  int exposed_ = 0;
  double point_nats_ = 5, unseen_nats_ = 3;
};

std::vector<Vec2> trial_shifts(const MemberView& view, bool anywhere) {
  std::vector<Vec2> out;
  constexpr int kSteps = static_cast<int>(kDisplacement_mm);
  std::vector<Vec2> axes;
  for (const FieldEdge& side : view.sides()) {
    const auto known = [&](const Vec2& a) { return std::abs(a.dot(side.outward)) > 0.99; };
    if (std::none_of(axes.begin(), axes.end(), known)) axes.push_back(side.outward);
  }
  for (const Vec2& axis : axes) {
    for (int i = -kSteps; i <= kSteps; ++i) {
      if (std::abs(i) >= 4) out.push_back(i * axis);
    }
  }
  if (!anywhere) return out;
  for (int x = -kSteps; x <= kSteps; x += 2) {
    for (int y = -kSteps; y <= kSteps; y += 2) out.push_back(Vec2(x, y));
  }
  return out;
}

}  // namespace

Displacement find_displacement(const workpiece::OutlineTemplate& outline, const TemplateFields& fields,
                               std::span<const PathPiece> path, const std::vector<Crossing>& crossings,
                               const Fit& fit, const Evidence& evidence, int member, bool anywhere) {
  const MemberView view(outline, fields, path, crossings, fit, evidence, member);
  struct Candidate {
    Vec2 shift;
    int explained;
  };
  std::vector<Candidate> candidates;
  for (const Vec2& shift : trial_shifts(view, anywhere)) {
    if (shift.norm() >= 4) candidates.push_back({shift, view.explained(shift)});
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.explained > b.explained; });
  Displacement best;
  best.member = member;
  best.gain = -1e300;
  const double here = view.drawn();
  for (std::size_t i = 0; i < std::min<std::size_t>(candidates.size(), 40); ++i) {
    const double gain = view.shifted(candidates[i].shift) - here;
    if (gain > best.gain) best = {member, candidates[i].shift, candidates[i].explained, gain};
  }
  return best;
}

}  // namespace weldcell::localize
