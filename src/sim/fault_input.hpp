// Faults that arrive while the simulator runs, one a line as a scene file has them. Private.
#pragma once

#include <string>
#include <vector>

#include "weldcell/sim/scene.hpp"

namespace weldcell::sim {

/// Reads a descriptor without ever waiting; ends quietly with it.
class FaultInput {
 public:
  explicit FaultInput(int fd) : fd_(fd) {}
  /// Those whose line has come to its end since the last call; a line that is no fault is told on stderr.
  std::vector<TimedFault> take();

 private:
  int fd_;
  std::string rest_;
};

}  // namespace weldcell::sim
