#include "wording.hpp"

#include <fmt/format.h>

#include <cmath>

#include "weldcell/base/units.hpp"

namespace weldcell::localize {

std::string millimetres(double mm) { return fmt::format("{:.{}f} mm", mm, std::abs(mm) < 10 ? 1 : 0); }

std::string degrees(double angle_rad) {
  const double value = deg(angle_rad);
  return fmt::format("{:.{}f} deg", value, std::abs(value) < 10 ? 1 : 0);
}

std::string side_word(const Vec2& outward) {
  const bool sideways = std::abs(outward.x()) > std::abs(outward.y());
  return sideways ? (outward.x() > 0 ? "right" : "left") : (outward.y() > 0 ? "upper" : "lower");
}

std::string edge_name(const workpiece::OutlineTemplate& outline, int edge) {
  const workpiece::VisibleEdge& e = outline.edges[static_cast<std::size_t>(edge)];
  return fmt::format("{} edge of {}", side_word(e.outward),
                     outline.member_names[static_cast<std::size_t>(e.member)]);
}

std::string direction_on_drawing(const Vec2& shift_mm) {
  std::string out;
  if (std::abs(shift_mm.x()) >= 0.5) {
    out =
        fmt::format("{} to the {}", millimetres(std::abs(shift_mm.x())), shift_mm.x() > 0 ? "right" : "left");
  }
  if (std::abs(shift_mm.y()) >= 0.5) {
    out += fmt::format("{}{} {}", out.empty() ? "" : " and ", millimetres(std::abs(shift_mm.y())),
                       shift_mm.y() > 0 ? "up" : "down");
  }
  return out.empty() ? "less than 0.5 mm" : out;
}

}  // namespace weldcell::localize
