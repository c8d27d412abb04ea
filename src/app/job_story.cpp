#include "weldcell/app/job_story.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "app/localize_json.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::app {

void JobStory::note(HostTime time, const job::Outputs& outputs) {
  if (!begun_ && !outputs.empty()) {
    begin_ = time;
    begun_ = true;
  }
  for (const job::Output& output : outputs) {
    if (const auto* event = std::get_if<job::LogEvent>(&output)) {
      events_.push_back({seconds(time - begin_), event->text, event->level != job::LogEvent::Level::Info});
    } else if (const auto* show = std::get_if<job::ShowDrawing>(&output)) {
      if (show->drawing) drawings_.push_back(show->drawing);
    } else if (const auto* motion = std::get_if<job::StartMotion>(&output)) {
      for (plan::ScanPass pass : motion->plan->passes) {
        pass.from_s += scan_s_;
        pass.to_s += scan_s_;
        passes_.push_back(pass);
      }
      scan_s_ += motion->plan->duration_s();
    } else if (const auto* finish = std::get_if<job::FinishJob>(&output)) {
      end_ = *finish;
    }
  }
}

void JobStory::note_input(const job::Input& input) {
  const auto* cycle = std::get_if<job::EgmCycle>(&input.body);
  if (cycle == nullptr) return;
  egm_.on(*cycle);
  for (const std::string& warning : egm_.take_warnings())
    events_.push_back({begun_ ? seconds(input.time - begin_) : 0, warning, true});
}

review::ReportInput JobStory::report(const job::Cell& cell, const cell::CellSetup& setup,
                                     const std::string& program_version,
                                     const std::string& accepted_at) const {
  review::ReportInput input;
  input.program_version = program_version;
  input.accepted_at = accepted_at;
  input.job = cell.status().job;
  input.state = end_ ? (end_->accepted ? "done" : "failed") : job::to_string(cell.status().state);
  input.reason = end_ ? end_->reason : cell.status().fault_text;
  if (cell.status().fault != job::FaultCode::None) input.cause = job::to_string(cell.status().fault);
  input.table_z_mm = setup.table.z_mm;
  if (cell.job()) input.workpiece = cell.job()->workpiece;
  if (const auto prepared = cell.prepared()) {
    input.outline = prepared->outline;
    input.planned = prepared->planned;
    input.beam_paths = prepared->paths;
  }
  if (const auto pass = cell.next_pass()) {
    input.beam_paths.insert(input.beam_paths.end(), pass->paths.begin(), pass->paths.end());
  }
  input.passes = passes_;
  if (const auto solution = cell.solution()) {
    input.verdict = solution->verdict.verdict;
    input.cause = solution->found.cause;
    input.surface = review::decimated(solution->evidence.shown);
    input.edges = solution->evidence.edges;
    input.path = solution->evidence.path;
    input.found = solution->found;
    input.heights = solution->heights;
    input.certificates = solution->certificates;
    const auto& align = solution->evidence.align;
    input.figures = {
        {"edge points", std::to_string(solution->evidence.edges.size()), ""},
        {"laser readings in the last pass", std::to_string(align.points), ""},
        {"of them without a height", std::to_string(align.invalid), ""},
        {"readings lost", std::to_string(align.lost), ""},
        {"laser clock against host", fmt::format("{:.1f}", align.laser_skew_ppm), "ppm"},
        {"robot clock against host", fmt::format("{:.1f}", align.robot_skew_ppm), "ppm"},
        {"residual latency",
         solution->found.latency_s ? fmt::format("{:.2f}", *solution->found.latency_s * 1e3) : "-", "ms"},
    };
  }
  input.figures.push_back({"scanning", fmt::format("{:.1f}", scan_s_), "s"});
  if (const EgmFigures& egm = egm_.figures(); egm.frames > 0) {
    input.figures.push_back({"robot's peak utilization", fmt::format("{:.0f}", egm.peak_percent), "%"});
    input.figures.push_back({"references cut by our limits", std::to_string(egm.limited), ""});
    input.figures.push_back({"robot frames too late to answer", std::to_string(egm.stale), ""});
  }
  input.events = events_;
  for (std::size_t i = 0; i < drawings_.size(); ++i) {
    const bool titled = cell.prepared() && i < cell.prepared()->steps.size();
    input.guidance.push_back(
        {titled ? cell.prepared()->steps[i].title : "step " + std::to_string(i + 1), *drawings_[i]});
  }
  return input;
}

std::string JobStory::result_json(const job::Cell& cell) const {
  using nlohmann::json;
  json out;
  out["job"] = cell.status().job;
  out["verdict"] = end_ ? end_->verdict : "none";
  out["accepted"] = end_ && end_->accepted;
  out["reason"] = end_ ? end_->reason : "";
  out["scan_seconds"] = scan_s_;
  out["localize_ms"] = solve_s_ * 1e3;
  out["passes"] = cell.status().pass;
  out["seams_done"] = cell.status().seams_done;
  if (const EgmFigures& egm = egm_.figures(); egm.frames > 0) {
    out["egm"] = {{"frames", egm.frames},
                  {"peak_utilization_percent", egm.peak_percent},
                  {"overloaded_frames", egm.overloaded},
                  {"limited", egm.limited},
                  {"stale", egm.stale},
                  {"malformed", egm.malformed}};
  }
  if (const auto solution = cell.solution()) {
    const auto& found = solution->found;
    out["found"] = {
        {"x_mm", found.pose.x_mm}, {"y_mm", found.pose.y_mm}, {"theta_deg", deg(found.pose.theta_rad)}};
    const auto offset =
        localize::offset_from_planned(cell.prepared()->outline, cell.prepared()->planned, found.pose);
    out["offset"] = {
        {"dx_mm", offset.dx_mm}, {"dy_mm", offset.dy_mm}, {"dtheta_deg", deg(offset.dtheta_rad)}};
    out["cause"] = found.cause;
    out["points"] = found.points;
    out["inliers"] = found.inliers;
    out["mean_error_mm"] = found.mean_error_mm;
    out["latency_ms"] = found.latency_s ? json(*found.latency_s * 1e3) : json();
    out["welds"] = welds_json(solution->certificates);
    out["members"] = members_json(found);
    out["top"] = plane_json(solution->heights.top);
    out["table"] = plane_json(solution->heights.table);
  }
  return out.dump(1);
}

}  // namespace weldcell::app
