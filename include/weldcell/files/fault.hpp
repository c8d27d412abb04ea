// A fault in a user's file: file:line: key: what: how to mend. Collected, all of them at once.
#pragma once

#include <string>
#include <vector>

namespace weldcell::files {

struct Fault {
  std::string file;
  int line = 0;     ///< 1-based; 0 = the whole file
  std::string key;  ///< dotted, e.g. "inspection.pattern"
  std::string what;
  std::string mend;
  /// "file:line: key: what: mend".
  std::string text() const;
};
using Faults = std::vector<Fault>;

/// By file, then line; faults of one line keep their order.
Faults in_order(Faults faults);

/// Every fault, one a line.
std::string text(const Faults& faults);

}  // namespace weldcell::files
