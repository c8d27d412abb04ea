#include "rows.hpp"

#include <algorithm>
#include <cmath>

#include "weldcell/base/units.hpp"

namespace weldcell::localize {

namespace {

/// Noise, a shifted member and latency let a true crossing lie this far past the end of its edge.
constexpr double kPastEnd_mm = 1.5;

}  // namespace

Row row_of(const TemplateFields& fields, const Crossing& crossing, const Match& m, double c, double s,
           bool inset_everywhere) {
  const FieldEdge& edge = fields.edges()[static_cast<std::size_t>(m.edge)];
  const Vec2& n = edge.outward;
  const Vec2& d = crossing.direction;
  const double across = n.x() * (c * d.x() + s * d.y()) + n.y() * (-s * d.x() + c * d.y());
  Row row;
  row.a = {n.x(), n.y(), n.y() * m.place.x() - n.x() * m.place.y()};
  row.l = 1e-3 * crossing.speed_mm_s * across;
  row.b = edge.round || inset_everywhere ? -1 : 0;
  row.residual = m.residual_mm;
  return row;
}

void move(CentredPose& pose, const Common& step) {
  const double c = std::cos(pose.theta_rad), s = std::sin(pose.theta_rad);
  pose.centre += Vec2(c * step(0) - s * step(1), s * step(0) + c * step(1));
  pose.theta_rad = wrap_pi(pose.theta_rad + step(2));
}

bool any_speed(const std::vector<Crossing>& crossings) {
  return std::any_of(crossings.begin(), crossings.end(), [](const Crossing& c) { return c.speed_mm_s > 0; });
}

double net_residual(const TemplateFields& fields, const Row& row, const Match& m, const FitState& state) {
  double net = row.residual - row.l * state.latency_ms - row.b * state.inset_mm;
  if (!state.members.empty()) {
    const FieldEdge& edge = fields.edges()[static_cast<std::size_t>(m.edge)];
    const Vec2 arm = m.place - fields.member_centroids()[static_cast<std::size_t>(edge.member)];
    const MemberShift& shift = state.members[static_cast<std::size_t>(edge.member)];
    const Vec2& n = edge.outward;
    net -= n.x() * shift.x() + n.y() * shift.y() + (n.y() * arm.x() - n.x() * arm.y()) * shift.z();
  }
  return net;
}

double squared_miss(double net, const Match& m) {
  const double past = std::max(0.0, m.beyond_mm - kPastEnd_mm);
  return net * net + past * past;
}

}  // namespace weldcell::localize
