#include "weldcell/files/fault.hpp"

namespace weldcell::files {

std::string Fault::text() const {
  std::string out = file;
  if (line > 0) out += (out.empty() ? "line " : ":") + std::to_string(line);
  for (const std::string* part : {&key, &what, &mend}) {
    if (!part->empty()) out += (out.empty() ? "" : ": ") + *part;
  }
  return out;
}

std::string text(const Faults& faults) {
  std::string out;
  for (const Fault& fault : faults) out += fault.text() + "\n";
  return out;
}

}  // namespace weldcell::files
