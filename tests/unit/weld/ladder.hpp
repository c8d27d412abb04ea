// A ladder of two rails and three rungs with six top welds, for the weld tests.
#pragma once

#include <string>

#include "weldcell/base/units.hpp"
#include "weldcell/localize/localize.hpp"
#include "weldcell/workpiece/workpiece.hpp"

namespace weldcell::weld::test {

inline workpiece::Member rectangle(const std::string& name, double x0, double y0, double x1, double y1) {
  workpiece::Member m;
  m.name = name;
  m.tag = name;
  m.outline = {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
  return m;
}

inline workpiece::Weld straight(const std::string& name, const std::string& a, const std::string& b,
                                const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  workpiece::Weld w;
  w.name = name;
  w.joins = {a, b};
  w.start = from;
  w.pieces = {{false, Eigen::Vector3d::Zero(), to}};
  w.tolerance_mm = 0.6;
  w.travel_angle_rad = rad(10);
  return w;
}

/// 600 x 300 mm, tubes 40 mm wide and high; rail_A below, rail_B above, rungs between them.
inline workpiece::Workpiece ladder() {
  workpiece::Workpiece w;
  w.name = "ladder";
  w.height_mm = 40;
  w.members = {rectangle("rail_A", -300, -150, 300, -110), rectangle("rail_B", -300, 110, 300, 150),
               rectangle("rung_1", -300, -110, -260, 110), rectangle("rung_2", -20, -110, 20, 110),
               rectangle("rung_3", 260, -110, 300, 110)};
  const double x[] = {-300, -20, 260};
  for (int i = 0; i < 3; ++i) {
    const std::string rung = "rung_" + std::to_string(i + 1), n = std::to_string(i + 1);
    w.welds.push_back(straight("a" + n, "rail_A", rung, {x[i], -110, 40}, {x[i] + 40, -110, 40}));
    w.welds.push_back(straight("b" + n, "rail_B", rung, {x[i] + 40, 110, 40}, {x[i], 110, 40}));
  }
  return w;
}

/// A trusted localization with member terms of the given sizes.
inline localize::Localization found_ladder(const workpiece::Workpiece& w, const Pose2& pose) {
  localize::Localization f;
  f.verdict = localize::Verdict::Weld;
  f.cause = "ok";
  f.reason = "found";
  f.pose = pose;
  f.centroid_base = pose * Vec2(3, -2);
  f.covariance << 0.0025, 0.0004, 1e-6, 0.0004, 0.0036, -2e-6, 1e-6, -2e-6, 2.5e-8;
  for (const workpiece::Member& m : w.members) {
    localize::MemberPose p;
    p.name = m.name;
    p.covariance = Eigen::Vector3d(0.008, 0.01, 4e-7).asDiagonal();
    p.points = 40;
    f.members.push_back(p);
  }
  return f;
}

}  // namespace weldcell::weld::test
