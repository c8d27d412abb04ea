// The rows that every bench prints: a table for people, or one JSON object with --json.
#pragma once

#include <cmath>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

namespace weldcell::bench {

enum class Better { Lower, Higher, None };

struct Row {
  std::string name;
  double value = 0;
  std::string unit;
  double reference = NAN;  ///< NAN: none
  double target = NAN;     ///< NAN: shown beside, not judged
  Better better = Better::Lower;
  bool met() const {
    if (std::isnan(target) || better == Better::None) return true;
    return better == Better::Lower ? value <= target : value >= target;
  }
};

inline std::string number(double value) {
  if (std::isnan(value)) return "null";
  char text[40];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

/// Prints and returns the exit code: 0 when every target is met, else 1.
inline int finish(const std::string& bench, const std::vector<Row>& rows, bool json) {
  bool all = true;
  if (json) std::printf("{\"bench\": \"%s\", \"rows\": [", bench.c_str());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Row& r = rows[i];
    all = all && r.met();
    if (json) {
      std::printf(
          "%s{\"name\": \"%s\", \"value\": %s, \"unit\": \"%s\", \"reference\": %s, \"target\": %s, \"met\": "
          "%s}",
          i > 0 ? ", " : "", r.name.c_str(), number(r.value).c_str(), r.unit.c_str(),
          number(r.reference).c_str(), number(r.target).c_str(), r.met() ? "true" : "false");
    } else {
      std::printf("%-58s %12s %-10s reference %10s  target %10s  %s\n", r.name.c_str(),
                  number(r.value).c_str(), r.unit.c_str(), number(r.reference).c_str(),
                  number(r.target).c_str(), std::isnan(r.target) ? "" : (r.met() ? "met" : "MISSED"));
    }
  }
  if (json) std::printf("]}\n");
  return all ? 0 : 1;
}

inline bool wants_json(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--json") == 0) return true;
  }
  return false;
}

}  // namespace weldcell::bench
