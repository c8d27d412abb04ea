#include "app/resident_modules.hpp"

#include "app/places.hpp"
#include "weldcell/weld/resident.hpp"

namespace weldcell::app {

Result<ResidentModules> resident_modules(const cell::CellSetup& cell) {
  ResidentModules out;
  for (const auto& [name, text] :
       {std::pair{"rapid/WeldcellEgm.mod", &out.mod}, std::pair{"rapid/WeldcellEgm.modx", &out.modx}}) {
    const auto read = read_shared_file(name);
    if (!read.ok()) return read.error();
    const auto filled = weld::fill_resident(*read, cell);
    if (!filled.ok()) return filled.error();
    *text = *filled;
  }
  return out;
}

}  // namespace weldcell::app
