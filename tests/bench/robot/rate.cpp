// Requests over Robot Web Services in a whole job, welding included, counted by the simulated controller.
#include <cstdlib>

#include "bench/robot/parts.hpp"
#include "weldcell/app/virtual_cell.hpp"
#include "weldcell/files/document.hpp"
#include "weldcell/files/job_file.hpp"
#include "weldcell/weld/resident.hpp"

namespace weldcell::bench {

namespace {

constexpr double kGiveUp_s = 900;

template <typename T>
T must(std::variant<T, files::Faults> read) {
  if (const auto* faults = std::get_if<files::Faults>(&read)) {
    std::fprintf(stderr, "bench_robot: %s\n", files::text(*faults).c_str());
    std::exit(2);
  }
  return std::get<T>(std::move(read));
}

}  // namespace

void rws_rate(std::vector<Row>& rows, const files::CellConfig& config) {
  const std::string folder = WELDCELL_CONFIG;
  const sim::Scene scene = must(sim::read_scene(folder + "/scenes/ladder.yaml", config, kSeed));
  app::VirtualJob job;
  job.order = must(files::read_job_file(folder + "/jobs/demo-ladder.yaml"));
  job.workpiece = scene.workpiece;
  const auto resident =
      weld::fill_resident(must(files::read_text_file(folder + "/rapid/WeldcellEgm.mod")), config.setup);
  job.resident_module = resident.ok() ? *resident : "";
  app::VirtualCell cell(config, scene, job);
  for (int cycle = 1; !cell.finished() && cell.now_s() < kGiveUp_s; ++cycle) {
    cell.advance();
    if (cycle % 50 == 0 && !cell.finished()) cell.act_as_person();
  }
  const sim::RwsLoad& load = cell.rws_load();
  rows.push_back({"whole job: seams welded", static_cast<double>(cell.controller().weld_traces().size()), "",
                  NAN, static_cast<double>(job.workpiece.welds.size()), Better::Higher});
  rows.push_back({"whole job: RWS requests, most in any second", static_cast<double>(load.most_in_a_second()),
                  "1/s", 20, 19});
  rows.push_back({"whole job: RWS requests, mean", static_cast<double>(load.total()) / cell.now_s(), "1/s",
                  NAN, NAN, Better::None});
  rows.push_back({"whole job: RWS requests refused (503)", static_cast<double>(load.refused()), "", NAN, 0});
}

}  // namespace weldcell::bench
