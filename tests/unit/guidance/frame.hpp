// A ladder on the table and a projector that looks straight down on it, for the guidance tests.
#pragma once

#include <string>

#include "weldcell/base/units.hpp"
#include "weldcell/cell/cell_setup.hpp"
#include "weldcell/workpiece/workpiece.hpp"

namespace weldcell::guidance::test {

inline workpiece::Member rectangle(const std::string& name, const std::string& tag, double x0, double y0,
                                   double x1, double y1) {
  workpiece::Member m;
  m.name = name;
  m.tag = tag;
  m.outline = {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
  return m;
}

/// rails 400 mm long at y 0..40 and 200..240, rungs between them.
inline workpiece::Workpiece ladder() {
  workpiece::Workpiece w;
  w.name = "ladder";
  w.height_mm = 40;
  w.members = {rectangle("rail_A", "1", 0, 0, 400, 40), rectangle("rail_B", "2", 0, 200, 400, 240),
               rectangle("rung_1", "3", 0, 40, 40, 200), rectangle("rung_2", "4", 360, 40, 400, 200)};
  return w;
}

/// Four 40 mm sides, mitred at 45 degrees, 800 x 500 mm.
inline workpiece::Workpiece mitre() {
  workpiece::Workpiece w;
  w.name = "mitre";
  w.height_mm = 40;
  w.members.resize(4);
  const std::vector<Polygon> outlines{{{0, 0}, {800, 0}, {760, 40}, {40, 40}},
                                      {{800, 0}, {800, 500}, {760, 460}, {760, 40}},
                                      {{800, 500}, {0, 500}, {40, 460}, {760, 460}},
                                      {{0, 500}, {0, 0}, {40, 40}, {40, 460}}};
  for (std::size_t i = 0; i < 4; ++i) {
    w.members[i].name = "side_" + std::to_string(i + 1);
    w.members[i].outline = outlines[i];
  }
  return w;
}

/// The projector's pose over a point of the table, picture's +X along Base +X, +Y along Base -Y.
inline Transform<Base, Projector> looking_down(const Vec2& at, double height_mm, double table_z_mm) {
  Transform<Base, Projector> T;
  T.iso.translate(Eigen::Vector3d(at.x(), at.y(), table_z_mm + height_mm));
  T.iso.rotate(Eigen::AngleAxisd(kPi, Eigen::Vector3d::UnitX()));
  return T;
}

}  // namespace weldcell::guidance::test
