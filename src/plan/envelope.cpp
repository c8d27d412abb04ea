#include <algorithm>
#include <cmath>

#include "patterns.hpp"
#include "poses.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/plan/scan_plan.hpp"

namespace weldcell::plan {

namespace {

/// A pose that the job will ask for, in frame Part: where a tool stands and which way it points.
struct Task {
  Eigen::Vector3d at = Eigen::Vector3d::Zero(), pointing = -Eigen::Vector3d::UnitZ();
};

/// Torch axis at a weld: leaning to the left of travel by the work angle and back against it by the travel
/// angle.
Eigen::Vector3d torch_axis(const workpiece::Weld& weld, const Eigen::Vector3d& travel) {
  Vec2 d = travel.head<2>();
  d = d.norm() > 1e-9 ? Vec2(d.normalized()) : Vec2::UnitX();
  const Vec2 left(-d.y(), d.x());
  const double work = weld.work_angle_rad, push = weld.travel_angle_rad;
  const Eigen::Vector3d across(std::sin(work) * left.x(), std::sin(work) * left.y(), std::cos(work));
  return std::sin(push) * Eigen::Vector3d(d.x(), d.y(), 0) - std::cos(push) * across;
}

std::vector<Task> weld_tasks(const workpiece::Workpiece& workpiece) {
  std::vector<Task> out;
  for (const workpiece::Weld& weld : workpiece.welds) {
    const std::vector<Eigen::Vector3d> points = workpiece::sample_path(weld, 1e6);
    if (points.size() < 2) continue;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::size_t j = i + 1 < points.size() ? i : i - 1;
      out.push_back({points[i], torch_axis(weld, points[j + 1] - points[j])});
    }
  }
  return out;
}

std::vector<Vec2> corners_of(const workpiece::Workpiece& workpiece) {
  std::vector<Vec2> out;
  for (const workpiece::Member& m : workpiece.members)
    out.insert(out.end(), m.outline.begin(), m.outline.end());
  return out;
}

/// The rim of the spiral that would search for the part where its placement is rough.
std::vector<Vec2> rim_of(const workpiece::Workpiece& workpiece) {
  Inspection wide;
  wide.pattern = Pattern::Spiral;
  wide.pitch_mm = 1e6;
  const std::vector<BeamPath> spiral = spiral_paths(workpiece, wide);
  std::vector<Vec2> out;
  if (spiral.empty()) return out;
  const std::vector<Vec2>& points = spiral.front().points;
  // The last turn but its start, at every twentieth of the way.
  for (std::size_t i = 0; i < 20; ++i) out.push_back(points[points.size() - 1 - i * points.size() / 40]);
  return out;
}

class Envelope {
 public:
  Envelope(const cell::CellSetup& cell, const workpiece::Workpiece& workpiece, std::vector<Vec2> scanned)
      : cell_(cell),
        scanned_(std::move(scanned)),
        welds_(weld_tasks(workpiece)),
        height_mm_(workpiece.height_mm),
        T_laser_flange_(cell.laser.T_flange_laser.inverse()),
        T_torch_flange_(cell.torch.T_flange_torch.inverse()) {}

  /// Worst dexterity over all tasks in the branch that serves all of them best; <= 0 where a task is out of
  /// reach.
  double score(const Pose2& pose) const {
    BranchScores worst;
    worst.fill(1);
    for (const Vec2& p : scanned_) {
      const Vec2 q = pose * p;
      BranchScores here;
      here.fill(-1);
      const Eigen::Vector3d at(q.x(), q.y(), cell_.table.z_mm + height_mm_ + cell_.laser.standoff_mm);
      for (int r = 0; r < 4; ++r)
        try_pose(at, -Eigen::Vector3d::UnitZ(), pose.theta_rad + kPi / 2 * r, T_laser_flange_.iso, here);
      if (!lower(worst, here)) return -1;
    }
    for (const Task& task : welds_) {
      const Eigen::Isometry3d part = part_on_table(pose, cell_.table.z_mm).iso;
      BranchScores here;
      here.fill(-1);
      constexpr int kRolls = 12;
      for (int r = 0; r < kRolls; ++r) {
        try_pose(part * task.at, part.linear() * task.pointing, 2 * kPi / kRolls * r, T_torch_flange_.iso,
                 here);
      }
      if (!lower(worst, here)) return -1;
    }
    return *std::max_element(worst.begin(), worst.end());
  }

 private:
  void try_pose(const Eigen::Vector3d& at, const Eigen::Vector3d& pointing, double roll,
                const Eigen::Isometry3d& T_tool_flange, BranchScores& here) const {
    Eigen::Isometry3d tool = Eigen::Isometry3d::Identity();
    tool.linear() = tool_rotation(pointing, roll);
    tool.translation() = at;
    raise_scores(cell_, {tool * T_tool_flange}, cell_.home, here);
  }
  static bool lower(BranchScores& worst, const BranchScores& here) {
    bool any = false;
    for (std::size_t b = 0; b < worst.size(); ++b) {
      worst[b] = std::min(worst[b], here[b]);
      any = any || worst[b] > 0;
    }
    return any;
  }

  const cell::CellSetup& cell_;
  std::vector<Vec2> scanned_;
  std::vector<Task> welds_;
  double height_mm_;
  Transform<Laser, Flange> T_laser_flange_;
  Transform<Torch, Flange> T_torch_flange_;
};

struct Best {
  double score = 0;
  Vec2 centre = Vec2::Zero();
  double theta_rad = 0;
};

/// The Part origin's pose when the outline's middle stands at `centre`.
Pose2 pose_of(const Vec2& centre, double theta_rad, const Vec2& middle) {
  const Vec2 t = centre - Pose2{0, 0, theta_rad}.rotate(middle);
  return {t.x(), t.y(), theta_rad};
}

bool on_table(const cell::CellSetup& cell, const Pose2& pose, const std::vector<Vec2>& corners) {
  if ((cell.table.area.max - cell.table.area.min).minCoeff() <= 0) return true;
  return std::all_of(corners.begin(), corners.end(), [&](const Vec2& p) {
    const Vec2 q = pose * p;
    return (q - cell.table.area.min).minCoeff() >= 0 && (cell.table.area.max - q).minCoeff() >= 0;
  });
}

/// Coarse grid, then a pattern search that halves its step; y stays 0 while the arm is symmetric about its X
/// axis.
Best search(const cell::CellSetup& cell, const Envelope& envelope, const std::vector<Vec2>& corners,
            const Vec2& middle) {
  const double reach = cell.arm.a1 + cell.arm.c2 + std::hypot(cell.arm.a2, cell.arm.c3);
  Best best;
  const auto offer = [&](const Vec2& centre, double theta) {
    const Pose2 pose = pose_of(centre, theta, middle);
    if (!on_table(cell, pose, corners)) return false;
    const double score = envelope.score(pose);
    if (score <= best.score + 1e-9) return false;
    best = {score, centre, theta};
    return true;
  };
  for (const double theta : {0.0, kPi / 2}) {
    for (double x = 0.2 * reach; x <= 0.9 * reach; x += 50) {
      for (const double y : {0.0, -0.15 * reach, 0.15 * reach}) offer({x, y}, theta);
    }
  }
  if (best.score <= 0) return best;
  for (double step = 32; step >= 4; step /= 2) {
    for (bool moved = true; moved;) {
      moved = false;
      for (const Vec2& d : {Vec2(1, 0), Vec2(-1, 0), Vec2(0, 1), Vec2(0, -1)}) {
        moved = offer(best.centre + step * d, best.theta_rad) || moved;
      }
    }
  }
  return best;
}

}  // namespace

Result<Pose2> centre_in_envelope(const cell::CellSetup& cell, const workpiece::Workpiece& workpiece) {
  const std::vector<Vec2> corners = corners_of(workpiece);
  if (corners.empty())
    return Error{"plan.empty", workpiece.name, "the workpiece has no members", "add members"};
  const Box2 box = bounds(corners);
  const Vec2 middle = (box.min + box.max) / 2;
  // Room for a rough placement first; where the arm is too small for that, the part itself.
  std::vector<Vec2> wide = rim_of(workpiece);
  wide.insert(wide.end(), corners.begin(), corners.end());
  Best best = search(cell, Envelope(cell, workpiece, std::move(wide)), corners, middle);
  if (best.score <= 0) best = search(cell, Envelope(cell, workpiece, corners), corners, middle);
  if (best.score <= 0) {
    return Error{"plan.unreachable", workpiece.name,
                 "nowhere on the table can the arm scan every corner and hold the torch at every weld",
                 "use a longer arm, another table height, or state the planned pose"};
  }
  return pose_of(best.centre, best.theta_rad, middle);
}

}  // namespace weldcell::plan
