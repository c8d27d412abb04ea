// A scene's faults at their time: counted from the start, from the first guided motion, or from the first
// arc. Pure.
#pragma once

#include <optional>
#include <vector>

#include "weldcell/sim/controller.hpp"

namespace weldcell::sim {

class FaultSchedule {
 public:
  explicit FaultSchedule(std::vector<TimedFault> faults) : waiting_(std::move(faults)) {}
  /// Those whose time has come at `now`, each once. Call it every cycle: it sees the beginnings itself.
  std::vector<TimedFault> due(HostTime now, const Controller& controller);

 private:
  std::vector<TimedFault> waiting_;
  std::optional<double> scan_begin_s_, weld_begin_s_;
};

}  // namespace weldcell::sim
