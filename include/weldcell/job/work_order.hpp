// A heavy step that the cell asked for, with everything it needs: run it on any thread, feed the answer back
// as input. Pure.
#pragma once

#include <memory>
#include <optional>

#include "weldcell/job/cell.hpp"

namespace weldcell::job {

enum class WorkKind : std::uint8_t { Plan, Pass, Solve };

struct WorkOrder {
  WorkKind kind = WorkKind::Plan;
  std::shared_ptr<const cell::CellSetup> setup;
  std::shared_ptr<const JobInput> job;
  std::shared_ptr<const Prepared> prepared;
  std::shared_ptr<const Solution> before;
  int pass = 0;  ///< the one to plan, from 2 on; of WorkKind::Pass only
  std::shared_ptr<const ScanRecord> scan;
};

/// The order behind an output, or nothing when the output asks for no work of this kind. Call it right after
/// the step that gave the output.
std::optional<WorkOrder> work_order(const Output& output, const Cell& cell,
                                    const std::shared_ptr<const cell::CellSetup>& setup);

/// PlanDone, PassPlanned or SolveDone.
InputBody run(const WorkOrder& order);

}  // namespace weldcell::job
