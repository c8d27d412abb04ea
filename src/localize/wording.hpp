// What the operator reads: places on the part and causes, in a welder's words. Pure.
#pragma once

#include <string>

#include "weldcell/workpiece/outline_template.hpp"

namespace weldcell::localize {

/// "3.2 mm"; "12 deg".
std::string millimetres(double mm);
std::string degrees(double rad);

/// "upper", "lower", "left" or "right": where a side with this outward normal lies on the drawing.
std::string side_word(const Vec2& outward);

/// "upper edge of rail_L" - as on the drawing.
std::string edge_name(const workpiece::OutlineTemplate& outline, int edge);

/// "20 mm to the right and 3 mm down" - as on the drawing.
std::string direction_on_drawing(const Vec2& shift_mm);

}  // namespace weldcell::localize
