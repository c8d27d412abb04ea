// The heavy steps of a job as pure functions: prepare, plan a pass, solve. The daemon runs them on its solver
// thread, replay and trials call them directly. Pure.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "weldcell/align/aligner.hpp"
#include "weldcell/edges/edges.hpp"
#include "weldcell/guidance/drawing.hpp"
#include "weldcell/job/job_order.hpp"
#include "weldcell/localize/height.hpp"
#include "weldcell/localize/localize.hpp"
#include "weldcell/plan/scan_plan.hpp"
#include "weldcell/weld/certificate.hpp"
#include "weldcell/weld/rapid.hpp"

namespace weldcell::job {

/// A job as it came out of the spool, its workpiece read.
struct JobInput {
  JobOrder order;
  workpiece::Workpiece workpiece;
};

/// Everything that is decided before anything moves.
struct Prepared {
  workpiece::OutlineTemplate outline;
  Pose2 planned;
  std::vector<guidance::GuideStep> steps;
  std::vector<plan::GuidePose> step_poses;       ///< one a step
  std::vector<plan::BeamPath> paths;             ///< of the first pass
  std::shared_ptr<const plan::MotionPlan> scan;  ///< the first pass
  std::vector<weld::WeldCertificate> nominal;    ///< welds at the planned pose, for reach and drawings
};

/// Errors: "plan.*" unreachable or refused, "weld.unreachable" at the planned pose, "template.*".
Result<Prepared> prepare(const cell::CellSetup& cell, const JobInput& job);

/// Raw data of one scan pass.
struct ScanRecord {
  std::vector<align::StampedReading> readings;
  std::vector<align::StampedFeedback> feedback;
};

/// Edges and travel of every pass so far; grows from pass to pass.
struct Evidence {
  std::vector<EdgePoint> edges;
  std::vector<PathPiece> path;
  std::vector<double> top_z_mm, table_z_mm;  ///< plateau heights beside each edge, Base
  std::vector<align::SurfacePoint> shown;    ///< thinned surface points for the report
  align::AlignSummary align;                 ///< of the last pass
  edges::EdgeSummary edge_summary;           ///< summed
};

/// What localization and re-planning made of the evidence.
struct Solution {
  Evidence evidence;
  localize::Localization found;
  localize::HeightFit heights;  ///< about the found centroid
  std::vector<weld::WeldCertificate> certificates;
  weld::JobVerdict verdict;
  std::vector<weld::TorchPath> torch;  ///< empty unless the verdict is weld
  std::string rapid;                   ///< module text; empty unless the verdict is weld
};

/// Aligns the pass, finds its edges, adds them to `before`, localizes, certifies, and plans the torch when
/// certified. A torch path that the arm cannot follow at the found pose turns the verdict into reject, with
/// the reason.
Solution solve(const cell::CellSetup& cell, const JobInput& job, const Prepared& prepared,
               const ScanRecord& scan, const Evidence& before);

/// The pass after the first, at the found pose. Where the pose stands and nothing is asked for but lines that
/// the last pass did not look along, these lines; else a zigzag over every member from both
/// sides and over its ends. The second pass of an adaptive inspection is that zigzag.
struct NextPass {
  std::vector<plan::BeamPath> paths;
  std::shared_ptr<const plan::MotionPlan> scan;
};
Result<NextPass> plan_next_pass(const cell::CellSetup& cell, const JobInput& job, const Prepared& prepared,
                                const Solution& before, int pass);

/// Passes that a job may take before a rescan verdict becomes its end.
int max_passes(const JobOrder& order);

/// A number that differs when any sample of the plan does; proves that replay planned the same motion.
std::uint64_t digest(const plan::MotionPlan& plan);

}  // namespace weldcell::job
