#include "receiver_choice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "weldcell/base/units.hpp"

namespace weldcell::plan {

namespace {

constexpr int kTurns = 5;  ///< half turns -2 .. 2
constexpr double kNever = std::numeric_limits<double>::infinity();
/// Weighs the arm's room against turning: 0.05 / dexterity counts like that many rad of turning.
constexpr double kRoomWeight = 0.05;

Eigen::Vector3d place_at(const Vec2& p, double angle) { return {p.x(), p.y(), angle}; }

/// Joints at the first point, in the branch of `near` where it reaches, else in the closest that does.
bool first_joints(const BeamArm& arm, const BeamPath& path, const kinematics::Joints& near, double& angle,
                  kinematics::Joints& out) {
  for (const double turn : {0.0, kPi}) {
    angle = path.receiver_angle_rad + turn;
    if (arm.joints(place_at(path.points.front(), angle), near, 1e9, out)) return true;
  }
  for (const double turn : {0.0, kPi}) {
    angle = path.receiver_angle_rad + turn;
    for (const kinematics::Joints& q :
         kinematics::inverse(arm.cell().arm, arm.flange(place_at(path.points.front(), angle)), near,
                             arm.cell().limits.limit_margin_rad)) {
      if (std::abs(std::sin(q[4])) < arm.cell().limits.min_sin_j5) continue;
      out = q;
      return true;
    }
  }
  return false;
}

/// Cost of a whole path at one receiver angle; infinite when the arm cannot follow it.
double cost_of(const BeamArm& arm, const BeamPath& path, double angle,
               const kinematics::Joints& at_first_point) {
  constexpr double kLook_mm = 25;
  kinematics::Joints q = at_first_point;
  Vec2 last = path.points.front();
  double room = kinematics::dexterity(arm.cell().arm, q);
  for (std::size_t i = 1; i < path.points.size(); ++i) {
    if ((path.points[i] - last).norm() < kLook_mm && i + 1 < path.points.size()) continue;
    kinematics::Joints next{};
    if (!arm.reach(place_at(last, angle), q, place_at(path.points[i], angle), next)) return kNever;
    q = next;
    last = path.points[i];
    room = std::min(room, kinematics::dexterity(arm.cell().arm, q));
  }
  return kRoomWeight / std::max(room, 1e-3);
}

struct Node {
  double angle = 0, cost = kNever;
  int from = -1;
};

}  // namespace

Result<ReceiverChoice> choose_receiver_angles(const BeamArm& arm, const std::vector<BeamPath>& paths,
                                              const kinematics::Joints& near) {
  double origin_angle = 0;
  kinematics::Joints origin{};
  const auto refuse = [](const BeamPath& path) {
    return Error{
        "plan.unreachable", path.name,
        fmt::format("the arm cannot hold the beam over ({:.1f}, {:.1f}) mm and follow the path from there",
                    path.points.front().x(), path.points.front().y()),
        "place the part nearer to the centre of the working envelope"};
  };
  if (!first_joints(arm, paths.front(), near, origin_angle, origin)) return refuse(paths.front());
  const Eigen::Vector3d origin_place = place_at(paths.front().points.front(), origin_angle);

  std::vector<std::array<Node, kTurns>> layers(paths.size());
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const double base = origin_angle + wrap_pi(paths[i].receiver_angle_rad - origin_angle);
    bool any = false;
    for (int k = 0; k < kTurns; ++k) {
      Node& node = layers[i][static_cast<std::size_t>(k)];
      node.angle = base + kPi * (k - kTurns / 2);
      kinematics::Joints q{};
      if (!arm.reach(origin_place, origin, place_at(paths[i].points.front(), node.angle), q)) continue;
      const double own = cost_of(arm, paths[i], node.angle, q);
      if (i == 0) {
        node.cost = own;
      } else {
        for (int b = 0; b < kTurns; ++b) {
          const Node& before = layers[i - 1][static_cast<std::size_t>(b)];
          const double cost = before.cost + own + std::abs(node.angle - before.angle);
          if (cost >= node.cost) continue;
          node.cost = cost;
          node.from = b;
        }
      }
      any = any || node.cost < kNever;
    }
    if (!any) return refuse(paths[i]);
  }

  const auto cheaper = [](const Node& a, const Node& b) { return a.cost < b.cost; };
  auto best = static_cast<int>(std::min_element(layers.back().begin(), layers.back().end(), cheaper) -
                               layers.back().begin());
  ReceiverChoice out;
  out.angles_rad.resize(paths.size());
  for (std::size_t i = paths.size(); i-- > 0;) {
    const Node& node = layers[i][static_cast<std::size_t>(best)];
    out.angles_rad[i] = node.angle;
    best = node.from;
  }
  if (!arm.reach(origin_place, origin, place_at(paths.front().points.front(), out.angles_rad.front()),
                 out.at_first)) {
    return refuse(paths.front());
  }
  return out;
}

}  // namespace weldcell::plan
