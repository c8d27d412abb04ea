#include "weldcell/job/work.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "weldcell/localize/localizer.hpp"

namespace weldcell::job {

namespace {

double top_z_mm(const cell::CellSetup& cell, const workpiece::Workpiece& workpiece) {
  return cell.table.z_mm + workpiece.height_mm;
}

/// The first look: as ordered, or for an adaptive inspection a spiral over the whole.
plan::Pattern first_pattern(const plan::Inspection& inspection) {
  return inspection.pattern == plan::Pattern::Adaptive ? plan::Pattern::Spiral : inspection.pattern;
}

weld::CertifyOptions certify_options(const cell::CellSetup& cell) {
  weld::CertifyOptions options;
  options.table_z_mm = cell.table.z_mm;
  return options;
}

localize::LocalizeOptions localize_options(const cell::CellSetup& cell, const JobInput& job,
                                           const Pose2& planned) {
  const Acceptance& acceptance = job.order.acceptance;
  localize::LocalizeOptions options;
  options.planned = planned;
  options.range_mm = acceptance.max_offset_mm;
  options.range_rad = acceptance.max_rotation_rad * 1.25;
  options.max_offset_mm = acceptance.max_offset_mm;
  options.max_rotation_rad = acceptance.max_rotation_rad * 1.05;
  options.max_mean_error_mm = acceptance.max_mean_error_mm;
  options.latency_sigma_s = cell.laser.latency_sigma_ms * 1e-3;
  // Passes over every end and joint are planned, so they may be asked for.
  options.prove_shift_mm = 10;
  options.prove_free_ends = true;
  return options;
}

edges::EdgeOptions edge_options(const cell::CellSetup& cell, const JobInput& job) {
  edges::EdgeOptions options;
  options.height_mm = job.workpiece.height_mm;
  options.spot_mm = cell.laser.spot_mm;
  options.noise_mm = cell.laser.noise_mm;
  // The angle is stated at mid range; the step's foot lies on the table, farther off.
  options.triangulation_rad = std::atan(std::tan(cell.laser.triangulation_rad) *
                                        (cell.laser.start_of_range_mm + cell.laser.range_mm / 2) /
                                        (cell.laser.standoff_mm + job.workpiece.height_mm));
  return options;
}

void add(Evidence& evidence, const edges::EdgeScan& scan) {
  evidence.edges.insert(evidence.edges.end(), scan.edges.begin(), scan.edges.end());
  evidence.path.insert(evidence.path.end(), scan.path.begin(), scan.path.end());
  evidence.top_z_mm.insert(evidence.top_z_mm.end(), scan.top_z_mm.begin(), scan.top_z_mm.end());
  evidence.table_z_mm.insert(evidence.table_z_mm.end(), scan.table_z_mm.begin(), scan.table_z_mm.end());
  edges::EdgeSummary& sum = evidence.edge_summary;
  sum.candidates += scan.summary.candidates;
  sum.accepted += scan.summary.accepted;
  sum.shadowed += scan.summary.shadowed;
  sum.bad_height += scan.summary.bad_height;
  sum.bad_fit += scan.summary.bad_fit;
  sum.paper_slot_too_wide += scan.summary.paper_slot_too_wide;
}

/// The lines that settle what was not looked at, at the found pose; the receiver looks along the edges.
std::vector<plan::BeamPath> lines_asked_for(const localize::Localization& found) {
  std::vector<plan::BeamPath> out;
  for (const localize::ScanLine& line : found.rescan) {
    Vec2 from = found.pose * line.from, to = found.pose * line.to;
    if (!out.empty() && (out.back().points.back() - to).norm() < (out.back().points.back() - from).norm())
      std::swap(from, to);
    const Vec2 d = to - from;
    out.push_back({line.member + " again", {from, to}, std::atan2(d.x(), -d.y())});
  }
  return out;
}

/// Whether every seam is inside its tolerance but for what was not looked at.
bool seams_stand(const cell::CellSetup& cell, const Solution& before) {
  const double most_gap_mm = certify_options(cell).max_gap_mm;
  return std::all_of(before.certificates.begin(), before.certificates.end(),
                     [&](const weld::WeldCertificate& c) {
                       return c.bound_mm <= c.tolerance_mm && std::abs(c.gap_mm) <= most_gap_mm;
                     });
}

std::vector<Segment> outline_at(const workpiece::OutlineTemplate& outline, const Pose2& pose) {
  std::vector<Segment> edges;
  for (const workpiece::VisibleEdge& edge : outline.edges)
    edges.push_back({pose * edge.line.a, pose * edge.line.b});
  return edges;
}

void add_thinned(std::vector<align::SurfacePoint>& shown, const std::vector<align::SurfacePoint>& points) {
  constexpr std::size_t kMostShown = 12000;
  const std::size_t stride = std::max<std::size_t>(1, points.size() / kMostShown);
  for (std::size_t i = 0; i < points.size(); i += stride) shown.push_back(points[i]);
}

}  // namespace

int max_passes(const JobOrder& order) { return order.inspection.pattern == plan::Pattern::Adaptive ? 3 : 2; }

Result<Prepared> prepare(const cell::CellSetup& cell, const JobInput& job) {
  Prepared out;
  auto outline = workpiece::build_template(job.workpiece);
  if (!outline.ok()) return outline.error();
  out.outline = *outline;

  if (job.order.planned) {
    out.planned = *job.order.planned;
  } else {
    auto centred = plan::centre_in_envelope(cell, job.workpiece);
    if (!centred.ok()) return centred.error();
    out.planned = *centred;
  }

  out.nominal = weld::assume_exact(job.workpiece, out.planned, certify_options(cell));
  auto torch = weld::plan_torch(cell, job.workpiece, out.nominal, cell.home);
  if (!torch.ok()) return torch.error();

  if (job.order.guidance) {
    out.steps = guidance::guide_steps(job.workpiece, out.planned);
    kinematics::Joints near = cell.home;
    for (const guidance::GuideStep& step : out.steps) {
      auto pose = plan::guide_pose(cell, step.centre_base_mm, step.heading_rad, near);
      if (!pose.ok()) return pose.error();
      near = pose->joints;
      out.step_poses.push_back(*pose);
    }
  }

  out.paths =
      plan::beam_paths(job.workpiece, out.planned, job.order.inspection, first_pattern(job.order.inspection));
  auto scan = plan::plan_scan(cell, out.paths, top_z_mm(cell, job.workpiece), job.order.inspection.speed_mm_s,
                              cell.home);
  if (!scan.ok()) return scan.error();
  scan->id = 1;
  out.scan = std::make_shared<const plan::MotionPlan>(std::move(*scan));
  return out;
}

Result<NextPass> plan_next_pass(const cell::CellSetup& cell, const JobInput& job, const Prepared& prepared,
                                const Solution& before, int pass) {
  const localize::Localization& found = before.found;
  const bool adaptive = job.order.inspection.pattern == plan::Pattern::Adaptive;
  plan::Inspection zigzag = job.order.inspection;
  zigzag.pattern = plan::Pattern::Zigzag;
  if (adaptive) {
    // A crossing in each direction near either end, and a pass over each end, tell shift, angle and length of
    // every member; the spiral has told the latency.
    zigzag.passes_per_member = 2;
    zigzag.speed_mm_s = std::min(zigzag.speed_mm_s, 200.0);
  }
  NextPass out;
  const std::vector<plan::BeamPath> lines = lines_asked_for(found);
  if (lines.empty() || (adaptive && pass == 2) || !seams_stand(cell, before))
    out.paths = plan::beam_paths(job.workpiece, found.pose, zigzag, plan::Pattern::Zigzag);
  // A zigzag at the found pose crosses every end by itself.
  if (out.paths.empty()) out.paths = lines;
  auto scan = plan::plan_scan(cell, out.paths, top_z_mm(cell, job.workpiece), zigzag.speed_mm_s,
                              prepared.scan->samples.back().q);
  if (!scan.ok()) return scan.error();
  scan->id = prepared.scan->id + 1 + digest(*scan) % 1000000;
  out.scan = std::make_shared<const plan::MotionPlan>(std::move(*scan));
  return out;
}

Solution solve(const cell::CellSetup& cell, const JobInput& job, const Prepared& prepared,
               const ScanRecord& scan, const Evidence& before) {
  Solution out;
  out.evidence = before;
  const std::vector<align::SurfacePoint> points =
      align::align(cell, scan.readings, scan.feedback, out.evidence.align);
  add_thinned(out.evidence.shown, points);
  const localize::LocalizeOptions options = localize_options(cell, job, prepared.planned);

  // Where the receiver sees a step's foot depends on the edge's direction: a first pose tells it, the second
  // look uses it.
  edges::EdgeOptions look = edge_options(cell, job);
  const edges::EdgeScan first = edges::detect(points, look);
  Evidence draft = out.evidence;
  add(draft, first);
  const localize::Localizer localizer(prepared.outline);
  out.found = localizer.localize(draft.edges, draft.path, options);
  look.outline = outline_at(prepared.outline, out.found.pose);
  add(out.evidence, edges::detect(points, look));
  localize::LeaningFit fit =
      localize::localize_leaning(localizer, out.evidence.edges, out.evidence.top_z_mm,
                                 out.evidence.table_z_mm, out.evidence.path, options, cell.laser.noise_mm);
  out.found = std::move(fit.found);
  out.heights = fit.heights;

  weld::CertifyOptions certify = certify_options(cell);
  if (out.heights.top) certify.top = weld::MeasuredTop{out.heights.reference, *out.heights.top};
  out.certificates = weld::certify(job.workpiece, out.found, certify);
  out.verdict = weld::decide(out.found, out.certificates);
  if (out.verdict.verdict != localize::Verdict::Weld) return out;

  auto torch = weld::plan_torch(cell, job.workpiece, out.certificates, cell.home);
  if (!torch.ok()) {
    out.verdict = {localize::Verdict::Reject, torch.error().text()};
    return out;
  }
  out.torch = std::move(*torch);
  weld::RapidOptions rapid;
  rapid.program_version = WELDCELL_VERSION;
  out.rapid = weld::rapid_module(cell, job.order.name, out.torch, rapid);
  return out;
}

std::uint64_t digest(const plan::MotionPlan& plan) {
  // FNV-1a over the bits of every sample.
  std::uint64_t hash = 14695981039346656037ULL;
  const auto mix = [&hash](double value) {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    for (int shift = 0; shift < 64; shift += 8) hash = (hash ^ ((bits >> shift) & 0xFF)) * 1099511628211ULL;
  };
  mix(plan.period_s);
  for (const plan::MotionSample& sample : plan.samples) {
    for (const double q : sample.q) mix(q);
    for (const double qd : sample.qd) mix(qd);
  }
  return hash;
}

}  // namespace weldcell::job
