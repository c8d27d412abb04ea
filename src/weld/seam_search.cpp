#include "seam_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "weldcell/base/units.hpp"

namespace weldcell::weld {

namespace {

using kinematics::Joints;

constexpr int kRolls = 24;
constexpr double kRollStep = 2 * kPi / kRolls;
constexpr std::size_t kStationStride = 10;  // samples: 20 mm
constexpr double kStationStep = rad(30);    // largest step of any joint between stations
constexpr double kSampleStep = rad(5);      // and between samples
constexpr double kLeadStepMm = 5;
constexpr double kShortestLeadMm = 50;
constexpr int kCopiesPerBranch = 2;  // turns of J4 and J6 beyond the two nearest only wind up the hoses
constexpr std::size_t kLayerLimit = 400;
constexpr std::size_t kWaysLimit = 12;
constexpr double kToolClearanceMm = 30;

struct Node {
  Joints q{};
  int roll = 0;
  double cost = 0;
  int parent = -1;
};

double travelled(const Joints& a, const Joints& b) {
  double sum = 0;
  for (std::size_t i = 0; i < 6; ++i) sum += std::abs(a[i] - b[i]);
  return sum;
}

class Ladder {
 public:
  Ladder(const SeamSearch& search, const SeamLine& seam, const Joints& near)
      : search_(search),
        seam_(seam),
        near_(near),
        T_torch_flange_(search.cell.torch.T_flange_torch.inverse()) {
    for (std::size_t k = 0; k + 1 < seam.tips.size(); k += kStationStride) stations_.push_back(k);
    stations_.push_back(seam.tips.size() - 1);
  }

  Result<std::vector<SeamWay>> run() {
    layers_.push_back(seed());
    for (std::size_t s = 1; s < stations_.size() && !layers_.back().empty(); ++s)
      layers_.push_back(advance(s));
    if (layers_.back().empty()) return unreachable(stations_[layers_.size() - 1]);
    std::vector<SeamWay> ways;
    std::size_t tried = 0;
    for (const int end : ends()) {
      if (ways.size() >= kWaysLimit * search_.over_heights_mm.size() || ++tried > 8 * kWaysLimit) break;
      finish(end, ways);
    }
    if (ways.empty()) return no_way_in();
    std::stable_sort(ways.begin(), ways.end(),
                     [](const SeamWay& a, const SeamWay& b) { return a.cost < b.cost; });
    return ways;
  }

 private:
  Transform<Base, Torch> torch(std::size_t k, double roll_rad) const {
    return torch_frame(seam_.tips[k], seam_.travel[k], seam_.work_angle_rad, seam_.travel_angle_rad,
                       roll_rad);
  }
  double margin() const { return search_.cell.limits.limit_margin_rad; }
  bool wrist_bent(const Joints& q) const {
    return std::abs(std::sin(q[4])) >= search_.cell.limits.min_sin_j5;
  }

  /// Cost of being at these joints; nothing when a tool would be in the table.
  std::optional<double> stay(const Joints& q) const {
    const double tool_z = lowest_tool_mm(search_.cell, q);
    if (tool_z < search_.cell.table.z_mm - 1) return std::nullopt;
    double cost = 0.05 * (1 / std::max(0.02, kinematics::dexterity(search_.cell.arm, q)) - 1);
    const double room = body_clearance(q);
    if (room < kToolClearanceMm) cost += 2 * (kToolClearanceMm - room) / kToolClearanceMm;
    return cost;
  }

  /// Height of laser and projector over the members.
  double body_clearance(const Joints& q) const {
    const Transform<Base, Flange> flange = kinematics::forward(search_.cell.arm, q);
    const double laser = (flange * search_.cell.laser.T_flange_laser).position_mm().z();
    const double projector = (flange * search_.cell.projector.T_flange_projector).position_mm().z();
    return std::min(laser, projector) - search_.top_z_mm;
  }

  std::vector<Node> seed() const {
    std::vector<Node> layer;
    for (int roll = 0; roll < kRolls; ++roll) {
      const auto pose = torch(0, roll * kRollStep) * T_torch_flange_;
      std::array<int, 8> copies{};
      for (const Joints& q : kinematics::inverse(search_.cell.arm, pose, near_, margin())) {
        const auto branch = static_cast<std::size_t>(kinematics::configuration(search_.cell.arm, q).cfx);
        if (!wrist_bent(q) || copies[branch] >= kCopiesPerBranch) continue;
        ++copies[branch];
        if (const auto cost = stay(q)) layer.push_back({q, roll, *cost, -1});
      }
    }
    return layer;
  }

  std::vector<Node> advance(std::size_t s) const {
    const std::vector<Node>& from = layers_.back();
    const int reach = seam_.straight ? 0 : 1;
    std::vector<Node> layer;
    for (std::size_t i = 0; i < from.size(); ++i) {
      for (int turn = -reach; turn <= reach; ++turn) {
        const int roll = from[i].roll + turn;
        Joints q{};
        if (!kinematics::inverse_near(search_.cell.arm,
                                      torch(stations_[s], roll * kRollStep) * T_torch_flange_, from[i].q,
                                      margin(), kStationStep, q) ||
            !wrist_bent(q)) {
          continue;
        }
        const auto cost = stay(q);
        if (!cost) continue;
        const Node node{q, roll, from[i].cost + *cost + travelled(from[i].q, q), static_cast<int>(i)};
        const auto same = std::find_if(layer.begin(), layer.end(), [&](const Node& n) {
          return n.roll == roll && travelled(n.q, q) < 1e-6;
        });
        if (same == layer.end()) {
          layer.push_back(node);
        } else if (node.cost < same->cost) {
          *same = node;
        }
      }
    }
    std::stable_sort(layer.begin(), layer.end(),
                     [](const Node& a, const Node& b) { return a.cost < b.cost; });
    if (layer.size() > kLayerLimit) layer.resize(kLayerLimit);
    return layer;
  }

  /// Last nodes in order of cost.
  std::vector<int> ends() const {
    std::vector<int> order(layers_.back().size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int>(i);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
      return layers_.back()[static_cast<std::size_t>(a)].cost <
             layers_.back()[static_cast<std::size_t>(b)].cost;
    });
    return order;
  }

  TorchTarget target(const Transform<Base, Torch>& pose, const Joints& q) const {
    return {pose, q, kinematics::configuration(search_.cell.arm, q)};
  }

  /// The chain that ends in this node, refined to every sample; false when a step between samples is too
  /// large.
  bool refine(int end, std::vector<TorchTarget>& out) const {
    std::vector<const Node*> chain(layers_.size());
    for (std::size_t s = layers_.size(); s-- > 0;) {
      chain[s] = &layers_[s][static_cast<std::size_t>(end)];
      end = chain[s]->parent;
    }
    out = {target(torch(0, chain[0]->roll * kRollStep), chain[0]->q)};
    for (std::size_t s = 1; s < stations_.size(); ++s) {
      const double span = static_cast<double>(stations_[s] - stations_[s - 1]);
      for (std::size_t k = stations_[s - 1] + 1; k <= stations_[s]; ++k) {
        const double share = static_cast<double>(k - stations_[s - 1]) / span;
        const double roll = (1 - share) * chain[s - 1]->roll + share * chain[s]->roll;
        const auto pose = torch(k, roll * kRollStep);
        Joints q{};
        if (!kinematics::inverse_near(search_.cell.arm, pose * T_torch_flange_, out.back().joints, margin(),
                                      kSampleStep, q) ||
            !wrist_bent(q)) {
          return false;
        }
        out.push_back(target(pose, q));
      }
    }
    return true;
  }

  /// Follows a straight line from a target, orientation kept; false when the arm cannot.
  bool lead(const TorchTarget& from, const Eigen::Vector3d& by, TorchTarget& to) const {
    const int steps = std::max(1, static_cast<int>(std::ceil(by.norm() / kLeadStepMm)));
    to = from;
    for (int i = 1; i <= steps; ++i) {
      Transform<Base, Torch> pose = from.T_base_torch;
      pose.iso.translation() += by * (static_cast<double>(i) / steps);
      Joints q{};
      if (!kinematics::inverse_near(search_.cell.arm, pose * T_torch_flange_, to.joints, margin(),
                                    kSampleStep, q)) {
        return false;
      }
      to = target(pose, q);
    }
    return true;
  }

  void finish(int end, std::vector<SeamWay>& ways) const {
    std::vector<TorchTarget> seam;
    if (!refine(end, seam)) return;
    const double back = std::max(kShortestLeadMm, search_.cell.weld.approach_mm);
    TorchTarget approach, retract;
    if (!lead(seam.front(), -back * seam.front().T_base_torch.rotation().col(2), approach) ||
        !lead(seam.back(), -back * seam.back().T_base_torch.rotation().col(2), retract)) {
      return;
    }
    for (const double height : search_.over_heights_mm) {
      TorchTarget over, away;
      const auto rise = [&](const TorchTarget& t) {
        return Eigen::Vector3d(0, 0,
                               std::max(0.0, search_.top_z_mm + height - t.T_base_torch.position_mm().z()));
      };
      if (!lead(approach, rise(approach), over) || !lead(retract, rise(retract), away)) continue;
      SeamWay way;
      way.targets = {over, approach};
      way.targets.insert(way.targets.end(), seam.begin(), seam.end());
      way.targets.push_back(retract);
      way.targets.push_back(away);
      way.first_seam = 2;
      way.last_seam = way.targets.size() - 3;
      way.cost = layers_.back()[static_cast<std::size_t>(end)].cost / static_cast<double>(stations_.size());
      ways.push_back(std::move(way));
    }
  }

  Error unreachable(std::size_t k) const {
    bool posed = false, bent = false;
    for (int roll = 0; roll < kRolls; ++roll) {
      for (const Joints& q : kinematics::inverse(
               search_.cell.arm, torch(k, roll * kRollStep) * T_torch_flange_, near_, margin())) {
        posed = true;
        bent = bent || wrist_bent(q);
      }
    }
    const std::string why = !posed  ? "the torch cannot get there at these angles, at no roll about the wire"
                            : !bent ? "the arm gets there only with a straight wrist"
                            : k > 0 ? "no one posture of the arm follows the seam up to there"
                                    : "a tool on the flange would touch the table";
    return {"weld.unreachable", "weld " + seam_.name, at(k) + ": " + why,
            "move the part towards the robot's middle, or change work_angle_deg or travel_angle_deg of this "
            "weld"};
  }

  Error no_way_in() const {
    return {"weld.unreachable", "weld " + seam_.name,
            at(0) + ": the seam can be followed, but the torch cannot come to it or leave it from above",
            "move the part towards the robot's middle, or shorten weld.approach_mm of the cell"};
  }

  std::string at(std::size_t k) const {
    double along = 0;
    for (std::size_t i = 0; i < k; ++i) along += (seam_.tips[i + 1] - seam_.tips[i]).norm();
    const Eigen::Vector3d& p = seam_.tips[k];
    return fmt::format("point {:.0f} mm from its start (x {:.1f} y {:.1f} z {:.1f})", along, p.x(), p.y(),
                       p.z());
  }

  const SeamSearch& search_;
  const SeamLine& seam_;
  const Joints& near_;
  Transform<Torch, Flange> T_torch_flange_;
  std::vector<std::size_t> stations_;
  std::vector<std::vector<Node>> layers_;
};

}  // namespace

SeamLine seam_line(const workpiece::Weld& weld, const std::vector<Eigen::Vector3d>& path) {
  constexpr std::size_t kWindow = 5;  // samples: 10 mm
  SeamLine out{weld.name, path, {}, weld.work_angle_rad, weld.travel_angle_rad, true};
  for (std::size_t k = 0; k < path.size(); ++k) {
    const Eigen::Vector3d& ahead = path[std::min(k + kWindow, path.size() - 1)];
    const Eigen::Vector3d& behind = path[k > kWindow ? k - kWindow : 0];
    out.travel.push_back((ahead - behind).normalized());
  }
  const Eigen::Vector3d chord = (path.back() - path.front()).normalized();
  for (const Eigen::Vector3d& p : path) {
    out.straight = out.straight && chord.cross(p - path.front()).norm() < 0.01;
  }
  return out;
}

Result<std::vector<SeamWay>> seam_ways(const SeamSearch& search, const SeamLine& seam, const Joints& near) {
  return Ladder(search, seam, near).run();
}

double lowest_tool_mm(const cell::CellSetup& cell, const Joints& joints) {
  const Transform<Base, Flange> flange = kinematics::forward(cell.arm, joints);
  return std::min({flange.position_mm().z(), (flange * cell.torch.T_flange_torch).position_mm().z(),
                   (flange * cell.laser.T_flange_laser).position_mm().z(),
                   (flange * cell.projector.T_flange_projector).position_mm().z()});
}

}  // namespace weldcell::weld
