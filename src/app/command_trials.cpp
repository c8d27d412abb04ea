// weldcell trials: seeded jobs through the whole chain in virtual time, with the paper's figures beside ours.
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "app/command_line.hpp"
#include "app/job_bundle.hpp"
#include "app/places.hpp"
#include "app/resident_modules.hpp"
#include "weldcell/app/virtual_cell.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/files/edge_file.hpp"
#include "weldcell/sim/scene.hpp"

namespace weldcell::app {

namespace {

using nlohmann::json;

/// Table 1 of the paper: 150 trials, +-15 mm, +-20 deg.
constexpr double kPaperX = 0.31, kPaperY = 0.43, kPaperTheta = 0.36, kPaperFailures = 0.13;

struct Trials {
  files::CellConfig config;
  std::string scene_file;
  VirtualJob job;
  int count = 0;
  std::uint64_t seed = 1;
  int threads = 2;
};

std::vector<VirtualOutcome> run(const Trials& trials, const sim::Scene& first) {
  std::vector<VirtualOutcome> outcomes(static_cast<std::size_t>(trials.count));
  std::atomic<int> next{0};
  std::mutex console;
  const bool progress = ::isatty(2) != 0;
  const auto work = [&] {
    for (int i = next++; i < trials.count; i = next++) {
      auto scene =
          sim::read_scene(trials.scene_file, trials.config, trials.seed + static_cast<std::uint64_t>(i));
      outcomes[static_cast<std::size_t>(i)] =
          run_virtual(trials.config, i == 0 ? first : std::get<sim::Scene>(scene), trials.job);
      if (progress) {
        const std::lock_guard lock(console);
        std::fprintf(stderr, "\rtrial %d of %d", i + 1, trials.count);
      }
    }
  };
  std::vector<std::thread> pool;
  for (int i = 0; i < trials.threads; ++i) pool.emplace_back(work);
  for (std::thread& thread : pool) thread.join();
  if (progress) std::fputc('\n', stderr);
  return outcomes;
}

Status keep_edges(const std::string& folder, std::uint64_t seed,
                  const std::vector<VirtualOutcome>& outcomes) {
  for (std::size_t i = 0; i < outcomes.size(); ++i) {
    const VirtualOutcome& o = outcomes[i];
    if (!o.solution) continue;
    const std::string stem = folder + "/" + std::to_string(seed + i);
    const json truth{{"x_mm", o.truth.x_mm}, {"y_mm", o.truth.y_mm}, {"theta_deg", deg(o.truth.theta_rad)}};
    for (const auto& [ending, text] :
         {std::pair<std::string, std::string>{
              ".edges.csv", files::edges_csv(o.solution->evidence.edges, o.solution->evidence.top_z_mm,
                                             o.solution->evidence.table_z_mm)},
          {".path.csv", files::path_csv(o.solution->evidence.path)},
          {".truth.json", truth.dump() + "\n"}}) {
      if (const Status written = write_file_durably(stem + ending, text); !written.ok()) return written;
    }
  }
  return Done{};
}

struct Spread {
  double std = 0, rms = 0, worst = 0;
};

Spread spread(const std::vector<double>& errors) {
  Spread s;
  if (errors.empty()) return s;
  const double n = static_cast<double>(errors.size());
  double mean = 0, square = 0;
  for (const double e : errors) {
    mean += e / n;
    square += e * e / n;
    s.worst = std::max(s.worst, std::abs(e));
  }
  s.rms = std::sqrt(square);
  s.std = std::sqrt(std::max(0.0, square - mean * mean) * n / std::max(1.0, n - 1));
  return s;
}

json spread_json(const Spread& s) { return {{"std", s.std}, {"rms", s.rms}, {"worst", s.worst}}; }

}  // namespace

int command_trials(Arguments arguments) {
  CommandLine line(
      arguments,
      "usage: weldcell trials --workpiece SCENE|SCENE.yaml [--count 150] [--seed 1] [--threads 2] [--weld] "
      "[--json]\n"
      "Jobs with drawn placements, clocks, noise and latency through the whole chain in virtual time: "
      "planning,\n"
      "EGM bytes, laser bytes, alignment, edges, pose, certificates, RAPID; no sockets, no sleeping.\n"
      "  --job JOB.yaml   the job (default config/jobs/demo-WORKPIECE.yaml)\n"
      "  --cell CELL      the cell (default config/cell-demo.yaml)\n"
      "  --weld           also run the weld programs and measure the torch on the true seams\n"
      "  --each           a line a trial on stderr, and the log of those that failed\n"
      "  --edges DIR      write SEED.edges.csv, SEED.path.csv and SEED.truth.json of each trial there\n",
      {"workpiece", "count", "seed", "threads", "job", "cell", "edges"}, {"json", "weld", "each"});
  if (line.exit_code()) return *line.exit_code();
  if (!line.has("workpiece")) return line.refuse("trials wants --workpiece");
  const auto count = line.number("count", 150), seed = line.number("seed", 1),
             threads = line.number("threads", 2);
  if (!count || !seed || !threads) return 2;
  if (*count < 1 || *threads < 1) return line.refuse("--count and --threads want at least 1");

  Trials trials;
  trials.count = static_cast<int>(*count);
  trials.seed = static_cast<std::uint64_t>(*seed);
  trials.threads = static_cast<int>(*threads);
  const std::string name = line.value("workpiece");
  trials.scene_file = name.find('.') == std::string::npos ? shared_file("scenes/" + name + ".yaml") : name;
  const std::string cell_file = line.value("cell", shared_file("cell-demo.yaml"));
  if (trials.scene_file.empty())
    return line.refuse("no scene for workpiece '" + name + "' under config/scenes");

  auto cell = files::read_cell_file(cell_file);
  if (const auto* faults = std::get_if<files::Faults>(&cell)) return line.refuse(files::text(*faults));
  trials.config = std::get<files::CellConfig>(std::move(cell));
  auto first = sim::read_scene(trials.scene_file, trials.config, trials.seed);
  if (const auto* faults = std::get_if<files::Faults>(&first)) return line.refuse(files::text(*faults));
  // Scenes of one workpiece share its job.
  const std::string& lies_there = std::get<sim::Scene>(first).workpiece.name;
  const std::string job_file = line.value("job", shared_file("jobs/demo-" + lies_there + ".yaml"));
  if (job_file.empty())
    return line.refuse("no config/jobs/demo-" + lies_there + ".yaml for workpiece '" + lies_there +
                       "': name a job by --job");
  auto bundle = load_job(job_file, "");
  if (const auto* fault = std::get_if<std::string>(&bundle)) return line.refuse(*fault);
  trials.job.order = std::get<JobBundle>(bundle).order;
  trials.job.workpiece = std::get<JobBundle>(bundle).workpiece;
  trials.job.order.execute_weld = line.has("weld");
  trials.job.order.guidance = false;
  const auto resident = resident_modules(trials.config.setup);
  if (!resident.ok()) return line.refuse(resident.error().text());
  trials.job.resident_module = resident->mod;

  if (line.has("edges")) {
    // Before the long run, not after it.
    std::error_code fault;
    std::filesystem::create_directories(line.value("edges"), fault);
    if (fault)
      return line.refuse("--edges " + line.value("edges") + ": " + fault.message() + ": check the place");
  }
  const std::vector<VirtualOutcome> outcomes = run(trials, std::get<sim::Scene>(first));

  if (line.has("edges")) {
    if (const Status kept = keep_edges(line.value("edges"), trials.seed, outcomes); !kept.ok())
      return line.refuse(kept.error().text());
  }
  std::vector<double> x, y, theta, seams, heights;
  int failures = 0;
  double scan_s = 0;
  for (std::size_t i = 0; i < outcomes.size(); ++i) {
    const VirtualOutcome& o = outcomes[i];
    if (line.has("each")) {
      std::fprintf(stderr,
                   "%4zu %-7s dx %+.3f dy %+.3f mm dtheta %+.4f deg  %d points, %d passes, scan %.1f s  %s\n",
                   i + trials.seed, o.verdict.c_str(), o.centroid_error_mm.x(), o.centroid_error_mm.y(),
                   deg(o.theta_error_rad), o.points, o.passes, o.scan_s, o.accepted ? "" : o.reason.c_str());
      if (!o.accepted) {
        for (const std::string& event : o.log) std::fprintf(stderr, "       %s\n", event.c_str());
      }
    }
    scan_s += o.scan_s / static_cast<double>(outcomes.size());
    if (!o.accepted) {
      ++failures;
      continue;
    }
    x.push_back(o.centroid_error_mm.x());
    y.push_back(o.centroid_error_mm.y());
    theta.push_back(deg(o.theta_error_rad));
    for (const sim::WeldedSeam& seam : o.welded) {
      seams.push_back(seam.lateral_error_mm);
      heights.push_back(seam.height_error_mm);
    }
  }
  const Spread sx = spread(x), sy = spread(y), st = spread(theta), ss = spread(seams), sh = spread(heights);
  const double share = static_cast<double>(failures) / static_cast<double>(outcomes.size());
  if (line.has("json")) {
    json out{{"workpiece", name},
             {"count", trials.count},
             {"seed", trials.seed},
             {"failures", failures},
             {"failure_share", share},
             {"x_mm", spread_json(sx)},
             {"y_mm", spread_json(sy)},
             {"theta_deg", spread_json(st)},
             {"scan_seconds_mean", scan_s},
             {"paper",
              {{"x_mm_std", kPaperX},
               {"y_mm_std", kPaperY},
               {"theta_deg_std", kPaperTheta},
               {"failure_share_below", kPaperFailures}}}};
    if (!seams.empty()) {
      out["seam_mm"] = spread_json(ss);
      out["seam_height_mm"] = spread_json(sh);
    }
    std::printf("%s\n", out.dump().c_str());
  } else {
    std::printf("%d trials of %s, seed %llu, virtual time\n\n", trials.count, name.c_str(),
                static_cast<unsigned long long>(trials.seed));
    std::printf("%-22s %10s %10s %10s %10s\n", "", "std", "rms", "worst", "paper std");
    std::printf("%-22s %10.4f %10.4f %10.4f %10.2f\n", "X, mm", sx.std, sx.rms, sx.worst, kPaperX);
    std::printf("%-22s %10.4f %10.4f %10.4f %10.2f\n", "Y, mm", sy.std, sy.rms, sy.worst, kPaperY);
    std::printf("%-22s %10.4f %10.4f %10.4f %10.2f\n", "theta, deg", st.std, st.rms, st.worst, kPaperTheta);
    if (!seams.empty()) {
      std::printf("%-22s %10.4f %10.4f %10.4f %10s\n", "torch beside seam, mm", ss.std, ss.rms, ss.worst,
                  "-");
      std::printf("%-22s %10.4f %10.4f %10.4f %10s\n", "torch over seam, mm", sh.std, sh.rms, sh.worst, "-");
    }
    std::printf("%-22s %9.1f%% %32s\n", "failures", 100 * share, "below 13%");
    std::printf("%-22s %10.1f s\n", "mean scan time", scan_s);
  }
  return failures == static_cast<int>(outcomes.size()) ? 1 : 0;
}

}  // namespace weldcell::app
