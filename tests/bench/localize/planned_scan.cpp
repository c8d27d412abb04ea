#include "planned_scan.hpp"

#include "weldcell/plan/scan_plan.hpp"

namespace weldcell::bench {

std::vector<PathPiece> planned_scan(const workpiece::Workpiece& workpiece) {
  std::vector<PathPiece> out;
  for (const plan::BeamPath& line :
       plan::beam_paths(workpiece, {}, plan::Inspection{}, plan::Pattern::Zigzag)) {
    for (std::size_t i = 1; i < line.points.size(); ++i) {
      const Vec2 &a = line.points[i - 1], &b = line.points[i];
      out.push_back({a.x(), a.y(), b.x(), b.y()});
    }
  }
  return out;
}

double end_pass_share(const workpiece::Workpiece& workpiece) {
  double ends = 0, others = 0;
  for (const plan::BeamPath& line :
       plan::beam_paths(workpiece, {}, plan::Inspection{}, plan::Pattern::Zigzag)) {
    for (std::size_t i = 1; i < line.points.size(); ++i) {
      const double length = (line.points[i] - line.points[i - 1]).norm();
      (line.name.find(" end ") != std::string::npos ? ends : others) += length;
    }
  }
  return ends / others;
}

}  // namespace weldcell::bench
