// What a conformance test found: one named rule after the other, each with cause and mend. Pure.
#pragma once

#include <string>
#include <vector>

namespace weldcell::app {

struct PlcFinding {
  std::string rule;
  bool passed = false;
  std::string cause;  ///< what was seen instead; empty when passed
  std::string mend;
};
using PlcFindings = std::vector<PlcFinding>;

/// One line a rule, or one JSON object {"who", "passed", "failed", "rules": [...]}; a newline ends both.
std::string findings_text(const PlcFindings& findings);
std::string findings_json(const std::string& who, const PlcFindings& findings);
bool all_passed(const PlcFindings& findings);

}  // namespace weldcell::app
