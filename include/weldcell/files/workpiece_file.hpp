// workpiece.yaml <-> Workpiece.
#pragma once

#include <string>
#include <string_view>
#include <variant>

#include "weldcell/files/fault.hpp"
#include "weldcell/workpiece/workpiece.hpp"

namespace weldcell::files {

std::variant<workpiece::Workpiece, Faults> parse_workpiece(std::string_view text, const std::string& name);
std::variant<workpiece::Workpiece, Faults> read_workpiece_file(const std::string& path);
/// YAML in the form that parse_workpiece() reads, millimetres with 6 decimals.
std::string workpiece_yaml(const workpiece::Workpiece& workpiece);

}  // namespace weldcell::files
