#include "weldcell/job/work_order.hpp"

#include <utility>

namespace weldcell::job {

std::optional<WorkOrder> work_order(const Output& output, const Cell& cell,
                                    const std::shared_ptr<const cell::CellSetup>& setup) {
  WorkOrder order;
  if (std::holds_alternative<PlanRequest>(output)) {
    order.kind = WorkKind::Plan;
  } else if (std::holds_alternative<PassRequest>(output)) {
    order.kind = WorkKind::Pass;
    order.pass = cell.status().pass + 1;
  } else if (const auto* solve = std::get_if<SolveRequest>(&output)) {
    order.kind = WorkKind::Solve;
    order.scan = solve->scan;
  } else {
    return std::nullopt;
  }
  order.setup = setup;
  order.job = std::make_shared<const JobInput>(*cell.job());
  order.prepared = cell.prepared();
  // What earlier passes saw counts only while they belong to this run of the job.
  if (cell.status().pass > 1 || order.kind == WorkKind::Pass) order.before = cell.solution();
  return order;
}

InputBody run(const WorkOrder& order) {
  switch (order.kind) {
    case WorkKind::Plan: {
      auto prepared = prepare(*order.setup, *order.job);
      if (!prepared.ok()) return PlanDone{prepared.error()};
      return PlanDone{std::make_shared<const Prepared>(std::move(*prepared))};
    }
    case WorkKind::Pass: {
      auto pass = plan_next_pass(*order.setup, *order.job, *order.prepared, *order.before, order.pass);
      if (!pass.ok()) return PassPlanned{pass.error()};
      return PassPlanned{std::make_shared<const NextPass>(std::move(*pass))};
    }
    case WorkKind::Solve:
      break;
  }
  static const Evidence kNothing;
  const Evidence& before = order.before ? order.before->evidence : kNothing;
  return SolveDone{std::make_shared<const Solution>(
      solve(*order.setup, *order.job, *order.prepared, *order.scan, before))};
}

}  // namespace weldcell::job
