#include "weldcell/files/fault.hpp"

#include <algorithm>
#include <tuple>

namespace weldcell::files {

std::string Fault::text() const {
  std::string out = file;
  if (line > 0) out += (out.empty() ? "line " : ":") + std::to_string(line);
  for (const std::string* part : {&key, &what, &mend}) {
    if (!part->empty()) out += (out.empty() ? "" : ": ") + *part;
  }
  return out;
}

Faults in_order(Faults faults) {
  std::stable_sort(faults.begin(), faults.end(), [](const Fault& a, const Fault& b) {
    return std::tie(a.file, a.line) < std::tie(b.file, b.line);
  });
  return faults;
}

std::string text(const Faults& faults) {
  std::string out;
  for (const Fault& fault : faults) out += fault.text() + "\n";
  return out;
}

}  // namespace weldcell::files
