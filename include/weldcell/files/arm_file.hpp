// <robots>/<model>.yaml -> ArmModel; read_arm_file() stands in cell_file.hpp. No file is touched here.
#pragma once

#include <string>
#include <string_view>
#include <variant>

#include "weldcell/files/schema.hpp"

namespace weldcell::files {

std::variant<kinematics::ArmModel, Faults> parse_arm(std::string_view text, const std::string& name);
/// The mapping below `arm:`; its faults go to the map's list.
kinematics::ArmModel read_arm(Map& map);

}  // namespace weldcell::files
