#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "seam_search.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::weld {

namespace {

using kinematics::Joints;

constexpr double kAirClearanceMm = 20;
constexpr double kAirStep = rad(4);
constexpr double kSteepest = 0.866;  // sine of the slope of a seam: 60 deg

/// Time of a joint move at full speed, s: what an air move costs.
double air_time(const kinematics::ArmModel& arm, const Joints& a, const Joints& b) {
  double worst = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    const double speed = arm.max_speed[i] > 0 ? arm.max_speed[i] : 1.0;
    worst = std::max(worst, std::abs(a[i] - b[i]) / speed);
  }
  return worst;
}

/// Whether every tool stays above the members on the joint move, or at least no lower than at its ends.
bool clear(const cell::CellSetup& cell, const Joints& a, const Joints& b, double top_z_mm) {
  const double floor =
      std::min({top_z_mm + kAirClearanceMm, lowest_tool_mm(cell, a) - 1, lowest_tool_mm(cell, b) - 1});
  double largest = 0;
  for (std::size_t i = 0; i < 6; ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  const int steps = std::max(1, static_cast<int>(std::ceil(largest / kAirStep)));
  for (int s = 1; s < steps; ++s) {
    Joints q{};
    const double share = static_cast<double>(s) / steps;
    for (std::size_t i = 0; i < 6; ++i) q[i] = (1 - share) * a[i] + share * b[i];
    if (lowest_tool_mm(cell, q) < floor) return false;
  }
  return true;
}

struct Step {
  double cost = std::numeric_limits<double>::infinity();
  int before = -1;
};

/// Picks one way a seam so that ways and air moves together cost least; the index of the seam that cannot be
/// reached from the one before it (or the number of seams: home cannot) when there is no such choice.
struct Choice {
  std::vector<std::size_t> way;
  std::size_t stuck_at = 0;
  bool found = false;
};

Choice choose(const cell::CellSetup& cell, const std::vector<std::vector<SeamWay>>& seams, const Joints& near,
              double top_z_mm) {
  std::vector<std::vector<Step>> table;
  for (std::size_t s = 0; s < seams.size(); ++s) {
    std::vector<Step> row(seams[s].size());
    bool any = false;
    for (std::size_t w = 0; w < row.size(); ++w) {
      const Joints& to = seams[s][w].targets.front().joints;
      if (s == 0) {
        if (clear(cell, near, to, top_z_mm)) row[w].cost = seams[s][w].cost + air_time(cell.arm, near, to);
      } else {
        for (std::size_t v = 0; v < seams[s - 1].size(); ++v) {
          const Joints& from = seams[s - 1][v].targets.back().joints;
          const double cost = table[s - 1][v].cost + seams[s][w].cost + air_time(cell.arm, from, to);
          if (cost < row[w].cost && clear(cell, from, to, top_z_mm)) row[w] = {cost, static_cast<int>(v)};
        }
      }
      any = any || std::isfinite(row[w].cost);
    }
    if (!any) return {{}, s, false};
    table.push_back(std::move(row));
  }
  int best = -1;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t w = 0; w < seams.back().size(); ++w) {
    const Joints& from = seams.back()[w].targets.back().joints;
    const double cost = table.back()[w].cost + air_time(cell.arm, from, cell.home);
    if (cost < least && clear(cell, from, cell.home, top_z_mm)) {
      least = cost;
      best = static_cast<int>(w);
    }
  }
  if (best < 0) return {{}, seams.size(), false};
  Choice out{std::vector<std::size_t>(seams.size()), 0, true};
  for (std::size_t s = seams.size(); s-- > 0;) {
    out.way[s] = static_cast<std::size_t>(best);
    best = table[s][out.way[s]].before;
  }
  return out;
}

Error stuck(const std::vector<WeldCertificate>& certificates, std::size_t at) {
  const std::string from = at == 0 ? "where the arm stands" : "weld " + certificates[at - 1].name;
  const std::string to = at < certificates.size() ? "weld " + certificates[at].name : "home";
  return {"weld.air_move", to,
          fmt::format("on the way from {} to {} a tool would come down to the members", from, to),
          "move the part, or choose a home posture with the torch high above the table"};
}

const workpiece::Weld* weld_named(const workpiece::Workpiece& workpiece, const std::string& name) {
  for (const workpiece::Weld& w : workpiece.welds) {
    if (w.name == name) return &w;
  }
  return nullptr;
}

Status fit_to_weld(const workpiece::Weld* weld, const WeldCertificate& c) {
  if (!weld) {
    return Error{"weld.unknown", "weld " + c.name, "the workpiece has no weld of this name",
                 "plan with the workpiece that was certified"};
  }
  if (c.verdict != localize::Verdict::Weld || c.path.size() < 2) {
    return Error{"weld.not_certified", "weld " + c.name, "it is not cleared for welding: " + c.reason,
                 "scan again or weld it manually"};
  }
  for (std::size_t k = 1; k < c.path.size(); ++k) {
    const Eigen::Vector3d step = c.path[k] - c.path[k - 1];
    if (std::abs(step.z()) <= kSteepest * step.norm()) continue;
    return Error{"weld.vertical", "weld " + c.name,
                 fmt::format("it climbs steeper than 60 deg at x {:.1f} y {:.1f} z {:.1f}", c.path[k].x(),
                             c.path[k].y(), c.path[k].z()),
                 "torch angles are stated against the table's normal: leave this seam to the welder"};
  }
  return Done{};
}

}  // namespace

Result<std::vector<TorchPath>> plan_torch(const cell::CellSetup& cell, const workpiece::Workpiece& workpiece,
                                          const std::vector<WeldCertificate>& certificates,
                                          const Joints& near) {
  if (certificates.empty()) return std::vector<TorchPath>{};
  const SeamSearch search{cell, cell.table.z_mm + workpiece.height_mm, {150, 300}};
  std::vector<std::vector<SeamWay>> seams;
  Joints from = near;
  for (const WeldCertificate& c : certificates) {
    const workpiece::Weld* weld = weld_named(workpiece, c.name);
    if (const Status fit = fit_to_weld(weld, c); !fit) return fit.error();
    auto ways = seam_ways(search, seam_line(*weld, c.path), from);
    if (!ways) return ways.error();
    from = ways->front().targets.back().joints;
    seams.push_back(std::move(ways).value());
  }
  const Choice choice = choose(cell, seams, near, search.top_z_mm);
  if (!choice.found) return stuck(certificates, choice.stuck_at);
  std::vector<TorchPath> out;
  for (std::size_t s = 0; s < seams.size(); ++s) {
    SeamWay& way = seams[s][choice.way[s]];
    out.push_back({certificates[s].name, std::move(way.targets), way.first_seam, way.last_seam});
  }
  return out;
}

}  // namespace weldcell::weld
