// The simulated PLC with its worker: what it sends next, from what the cell says. Time is an argument. Pure.
#pragma once

#include "weldcell/wire/plc_map.hpp"

namespace weldcell::sim {

class PlcWorker {
 public:
  /// confirm_after_s: the worker's pace at each guidance step. rearm: clears, arms and resumes after faults,
  /// too.
  PlcWorker(double confirm_after_s, bool rearm) : confirm_after_s_(confirm_after_s), rearm_(rearm) {}

  /// Called a few times a second with the newest status; returns what to write.
  wire::PlcOrder step(const wire::PlcStatus& status, double now_s);

 private:
  wire::PlcCommand wanted(const wire::PlcStatus& status, double now_s);

  double confirm_after_s_;
  bool rearm_;
  bool begun_ = false;
  wire::PlcOrder order_;
  double sent_s_ = -1e9, step_seen_s_ = 0;
  std::uint16_t step_ = 0, confirming_ = 0, confirmed_ = 0;
  wire::PlcCommand last_ = wire::PlcCommand::None;
};

}  // namespace weldcell::sim
