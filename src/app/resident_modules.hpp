// The resident RAPID module's text for both controller generations, with the cell's own values in it.
#pragma once

#include <string>

#include "weldcell/base/result.hpp"
#include "weldcell/cell/cell_setup.hpp"

namespace weldcell::app {

/// By generation of RWS: RobotWare 6 (.mod) and 7 (.modx).
struct ResidentModules {
  std::string mod, modx;
};

/// From the program's own files (config/rapid). Errors "file.read", "rapid.resident".
Result<ResidentModules> resident_modules(const cell::CellSetup& cell);

}  // namespace weldcell::app
