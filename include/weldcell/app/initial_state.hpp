// The cell's memory at the beginning of a record, as JSON.
#pragma once

#include <string>

#include "weldcell/job/cell.hpp"

namespace weldcell::app {

std::string memory_json(const job::CellMemory& memory);
/// Defaults for whatever is missing or unreadable.
job::CellMemory memory_from_json(const std::string& text);

}  // namespace weldcell::app
