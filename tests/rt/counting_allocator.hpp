// Counts every allocation and release of the calling thread, of new and of malloc alike.
#pragma once

#include <cstdint>

namespace weldcell::rt {

struct AllocationCount {
  std::uint64_t allocations = 0, releases = 0;
};

/// So far, of this thread.
AllocationCount allocation_count();

}  // namespace weldcell::rt
