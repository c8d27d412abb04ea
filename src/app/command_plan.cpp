// weldcell plan: what a job would do, before anything moves.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/command_line.hpp"
#include "app/job_bundle.hpp"
#include "app/places.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/files/cell_file.hpp"
#include "weldcell/job/work.hpp"
#include "weldcell/review/report.hpp"

namespace weldcell::app {

namespace {

using nlohmann::json;

json plan_json(const job::Prepared& prepared) {
  json out{{"planned",
            {{"x_mm", prepared.planned.x_mm},
             {"y_mm", prepared.planned.y_mm},
             {"theta_deg", deg(prepared.planned.theta_rad)}}},
           {"scan_seconds", prepared.scan->duration_s()},
           {"scan_paths", prepared.paths.size()},
           {"visible_edges", prepared.outline.edges.size()}};
  out["guidance"] = json::array();
  for (const auto& step : prepared.steps)
    out["guidance"].push_back({{"title", step.title}, {"fixtures", step.fixtures.size()}});
  out["welds"] = json::array();
  for (const auto& weld : prepared.nominal) {
    out["welds"].push_back({{"name", weld.name}, {"tolerance_mm", weld.tolerance_mm}, {"reachable", true}});
  }
  out["symmetries"] = json::array();
  for (const auto& s : prepared.outline.symmetries) {
    out["symmetries"].push_back({{"theta_deg", deg(s.map.theta_rad)}, {"gap_mm", s.gap_mm}});
  }
  return out;
}

}  // namespace

int command_plan(Arguments arguments) {
  CommandLine line(arguments,
                   "usage: weldcell plan JOB.yaml --cell CELL.yaml [--json] [--report FILE.html]\n"
                   "Guidance steps, scan path, times and reach of a job; nothing moves.\n",
                   {"cell", "report"}, {"json"});
  if (line.exit_code()) return *line.exit_code();
  if (line.plain().size() != 1) return line.refuse("plan wants one job file");
  auto cell = files::read_cell_file(line.value("cell", shared_file("cell-demo.yaml")));
  if (const auto* faults = std::get_if<files::Faults>(&cell)) {
    std::fprintf(stderr, "%s\n", files::text(*faults).c_str());
    return 2;
  }
  const auto& setup = std::get<files::CellConfig>(cell).setup;
  const auto bundle = load_job(line.plain()[0], "");
  if (const auto* fault = std::get_if<std::string>(&bundle)) {
    std::fprintf(stderr, "%s\n", fault->c_str());
    return 2;
  }
  const auto& job = std::get<JobBundle>(bundle);
  const auto prepared = job::prepare(setup, {job.order, job.workpiece});
  if (!prepared.ok()) {
    std::fprintf(stderr, "%s: %s\n", line.plain()[0].c_str(), prepared.error().text().c_str());
    return 1;
  }
  if (line.has("report")) {
    review::ReportInput input;
    input.job = job.order.name;
    input.state = "planned";
    input.reason = "nothing has moved yet";
    input.workpiece = job.workpiece;
    input.outline = prepared->outline;
    input.planned = prepared->planned;
    input.table_z_mm = setup.table.z_mm;
    input.beam_paths = prepared->paths;
    input.passes = prepared->scan->passes;
    const Status written = write_file_durably(line.value("report"), review::report_html(input));
    if (!written.ok()) {
      std::fprintf(stderr, "%s\n", written.error().text().c_str());
      return 3;
    }
  }
  if (line.has("json")) {
    std::printf("%s\n", plan_json(*prepared).dump().c_str());
    return 0;
  }
  std::printf("%s: planned at %.1f, %.1f mm, %.2f deg\n", job.order.name.c_str(), prepared->planned.x_mm,
              prepared->planned.y_mm, deg(prepared->planned.theta_rad));
  std::printf("scan: %zu paths, %.1f s\n", prepared->paths.size(), prepared->scan->duration_s());
  for (const auto& step : prepared->steps)
    std::printf("guidance: %s (%zu magnets)\n", step.title.c_str(), step.fixtures.size());
  for (const auto& weld : prepared->nominal)
    std::printf("weld %s: reachable, tolerance %.2f mm\n", weld.name.c_str(), weld.tolerance_mm);
  for (const auto& s : prepared->outline.symmetries) {
    std::printf("%s by %.1f deg (gap %.2f mm)\n", s.gap_mm < 0.01 ? "symmetric" : "nearly symmetric",
                deg(s.map.theta_rad), s.gap_mm);
  }
  return 0;
}

}  // namespace weldcell::app
