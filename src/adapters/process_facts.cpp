#include "weldcell/adapters/process_facts.hpp"

#include <sys/resource.h>

#include <fstream>
#include <string>

namespace weldcell::adapters {
namespace {

std::int64_t status_field(const std::string& name) {
  std::ifstream in("/proc/self/status");
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with(name + ":")) return std::strtoll(line.c_str() + name.size() + 1, nullptr, 10);
  }
  return 0;
}

double seconds_of(const timeval& t) {
  return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_usec) * 1e-6;
}

}  // namespace

std::int64_t rss_kb() { return status_field("VmRSS"); }
std::int64_t peak_rss_kb() { return status_field("VmHWM"); }
int thread_count() { return static_cast<int>(status_field("Threads")); }

double cpu_seconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime);
}

}  // namespace weldcell::adapters
