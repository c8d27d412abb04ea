// Runs a program without a shell, inside limits, and collects what it says. Blocks.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "weldcell/base/result.hpp"

namespace weldcell::adapters {

struct ChildLimits {
  int timeout_s = 60;
  int cpu_s = 45;
  unsigned long memory_bytes = 2UL << 30;
  std::size_t output_bytes = 4'000'000;  ///< of stdout; stderr keeps its first 64 kB
};

struct ChildOutcome {
  int exit_code = -1;  ///< -1 when a signal ended it
  int signal = 0;
  bool timed_out = false, too_much_output = false;
  /// 0: the child had no network; else the errno with which the kernel refused to take it away.
  int network_errno = 0;
  std::string out, err;
};

/// arguments[0] is the program's path. The child gets no stdin, an almost empty environment, no core file,
/// its own process group (killed whole), no new privileges and, where the kernel permits, no network. Errors:
/// "child.start".
Result<ChildOutcome> run_limited(const std::vector<std::string>& arguments, const ChildLimits& limits);

}  // namespace weldcell::adapters
