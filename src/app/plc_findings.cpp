#include "app/plc_findings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace weldcell::app {

bool all_passed(const PlcFindings& findings) {
  return !findings.empty() && std::ranges::all_of(findings, &PlcFinding::passed);
}

std::string findings_text(const PlcFindings& findings) {
  std::string out;
  std::size_t failed = 0;
  for (const PlcFinding& f : findings) {
    out += fmt::format("{:4}  {}\n", f.passed ? "pass" : "FAIL", f.rule);
    if (f.passed) continue;
    ++failed;
    out += fmt::format("      seen: {}\n      mend: {}\n", f.cause, f.mend);
  }
  out += fmt::format("{} rules, {} failed\n", findings.size(), failed);
  return out;
}

std::string findings_json(const std::string& who, const PlcFindings& findings) {
  nlohmann::json rules = nlohmann::json::array();
  std::size_t passed = 0;
  for (const PlcFinding& f : findings) {
    passed += f.passed ? 1 : 0;
    rules.push_back({{"rule", f.rule}, {"passed", f.passed}, {"cause", f.cause}, {"mend", f.mend}});
  }
  return nlohmann::json{
             {"who", who}, {"passed", passed}, {"failed", findings.size() - passed}, {"rules", rules}}
             .dump() +
         "\n";
}

}  // namespace weldcell::app
