// What this process costs, from /proc/self. Any thread.
#pragma once

#include <cstdint>

namespace weldcell::adapters {

/// Resident memory now and at its highest, kB; 0 when /proc does not tell.
std::int64_t rss_kb();
std::int64_t peak_rss_kb();
/// User and system time of all threads since the start.
double cpu_seconds();
int thread_count();

}  // namespace weldcell::adapters
