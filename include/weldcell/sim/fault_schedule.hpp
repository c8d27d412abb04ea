// A scene's faults at their time: counted from the start, from the first guided motion, or from the first
// arc. Pure.
#pragma once

#include <optional>
#include <vector>

#include "weldcell/sim/controller.hpp"

namespace weldcell::sim {

class FaultSchedule {
 public:
  explicit FaultSchedule(const std::vector<TimedFault>& faults);
  /// One more, counted from `now`, or from the next guided motion or arc, or the one that lasts now.
  void add(const TimedFault& fault, HostTime now);
  /// Those whose time has come at `now`, each once. Call it every cycle: it sees the beginnings itself.
  std::vector<TimedFault> due(HostTime now, const Controller& controller);

 private:
  struct Waiting {
    TimedFault fault;
    std::optional<double> since_s = {};  ///< what its time counts from, once that has come
  };
  std::vector<Waiting> waiting_;
};

}  // namespace weldcell::sim
