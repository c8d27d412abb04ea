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
  double standard_error = NAN;  ///< of the value, where it is a mean over seeded trials; NAN: not stated
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

inline void print_json(std::FILE* out, const std::string& bench, const std::vector<Row>& rows) {
  std::fprintf(out, "{\"bench\": \"%s\", \"rows\": [", bench.c_str());
  const char* comma = "";
  for (const Row& r : rows) {
    std::fprintf(out,
                 "%s{\"name\": \"%s\", \"value\": %s, \"unit\": \"%s\", \"reference\": %s, \"target\": %s, "
                 "\"standard_error\": %s, \"met\": %s}",
                 comma, r.name.c_str(), number(r.value).c_str(), r.unit.c_str(), number(r.reference).c_str(),
                 number(r.target).c_str(), number(r.standard_error).c_str(), r.met() ? "true" : "false");
    comma = ", ";
  }
  std::fprintf(out, "]}\n");
}

inline void print_table(const std::vector<Row>& rows) {
  for (const Row& r : rows) {
    char error[24] = "";
    if (!std::isnan(r.standard_error)) std::snprintf(error, sizeof error, "+- %.2g", r.standard_error);
    std::printf("%-58s %12s %-10s %-10s reference %10s  target %10s  %s\n", r.name.c_str(),
                number(r.value).c_str(), error, r.unit.c_str(), number(r.reference).c_str(),
                number(r.target).c_str(), std::isnan(r.target) ? "" : (r.met() ? "met" : "MISSED"));
  }
}

/// Prints and returns the exit code: 0 when every target is met, else 1.
inline int finish(const std::string& bench, const std::vector<Row>& rows, bool json) {
  if (json) {
    print_json(stdout, bench, rows);
  } else {
    print_table(rows);
  }
  for (const Row& r : rows) {
    if (!r.met()) return 1;
  }
  return 0;
}

inline bool wants_json(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--json") == 0) return true;
  }
  return false;
}

}  // namespace weldcell::bench
