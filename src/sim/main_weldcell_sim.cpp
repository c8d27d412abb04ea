// weldcell-sim: pretends to be the ABB controller, the laser and the PLC on their real wires, with a known
// truth.
#include <atomic>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "sim/live_cell.hpp"
#include "sim/tls_identity.hpp"

namespace {

using namespace weldcell;

std::atomic<bool> stop_asked{false};
static_assert(std::atomic<bool>::is_always_lock_free);

constexpr const char* kUsage =
    "usage: weldcell-sim --cell CELL --scene SCENE --truth truth.json [options]\n"
    "\n"
    "  --cell FILE        the cell's configuration: addresses, arm, laser, table\n"
    "  --scene FILE       what really stands on the table and how the devices really behave\n"
    "  --truth FILE       where the truth is written, at the start, after each weld program and at the end\n"
    "  --seed N           overrides the scene's seed\n"
    "  --fault SPEC       KIND[@[scan+|weld+]SECONDS][:DURATION], may be repeated; KIND is laser_drop, "
    "laser_stall,\n"
    "                     egm_silence, estop, guardstop, motors_off, motors_on, manual, program_stop, "
    "pp_moved,\n"
    "                     collision, singularity, restart, rws_503, rws_silence, laser_clock_step, "
    "laser_clock_back,\n"
    "                     laser_clock_stop, laser_clock_reset, robot_clock_step or robot_clock_back; e.g.\n"
    "                     laser_drop@scan+5:2\n"
    "  --faults-from-stdin   a SPEC a line while it runs, counted from then, or from the next scan or arc\n"
    "  --no-plc           without the simulated PLC\n"
    "  --plc-rearm        the simulated worker also clears faults, arms again and resumes\n"
    "  --ports-file FILE  writes the ports in use as JSON, with the fingerprint of RWS 2.0's certificate\n"
    "  --certificate FILE key and certificate of RWS 2.0 as PEM, made when it does not exist; without it a "
    "new\n"
    "                     one is made at every start\n"
    "  --make-certificate FILE   makes that file, prints its SHA-256 fingerprint for the cell file, and "
    "ends\n"
    "\n"
    "exit codes: 0 ended by a signal, 2 bad input or usage, 3 an address cannot be had\n";

struct Options {
  std::string cell, scene, ports_file;
  std::uint64_t seed = 0;
  std::vector<sim::TimedFault> faults;
  sim::LiveOptions live;
};

std::optional<Options> refuse(const std::string& what) {
  std::fprintf(stderr, "weldcell-sim: %s\n%s", what.c_str(), kUsage);
  return std::nullopt;
}

std::optional<Options> parse(int count, char** words) {
  Options out;
  for (int i = 1; i < count; ++i) {
    const std::string word = words[i];
    if (word == "--no-plc") {
      out.live.plc = false;
      continue;
    }
    if (word == "--faults-from-stdin") {
      out.live.fault_fd = 0;
      continue;
    }
    if (word == "--plc-rearm") {
      out.live.plc_rearm = true;
      continue;
    }
    if (i + 1 >= count) return refuse("'" + word + "' is unknown or needs a value");
    const std::string value = words[++i];
    if (word == "--cell") {
      out.cell = value;
    } else if (word == "--scene") {
      out.scene = value;
    } else if (word == "--truth") {
      out.live.truth_file = value;
    } else if (word == "--certificate") {
      out.live.certificate_file = value;
    } else if (word == "--ports-file") {
      out.ports_file = value;
    } else if (word == "--seed") {
      const auto read = std::from_chars(value.data(), value.data() + value.size(), out.seed);
      if (read.ec != std::errc{} || read.ptr != value.data() + value.size() || out.seed == 0) {
        return refuse("--seed " + value + ": a whole number above 0 is needed");
      }
    } else if (word == "--fault") {
      auto fault = sim::parse_fault(value);
      if (!fault) return refuse("--fault " + fault.error().text());
      out.faults.push_back(*fault);
    } else {
      return refuse("'" + word + "' is unknown");
    }
  }
  if (out.cell.empty() || out.scene.empty() || out.live.truth_file.empty()) {
    return refuse("--cell, --scene and --truth are needed");
  }
  return out;
}

std::optional<sim::Scene> read(const Options& options) {
  auto cell = files::read_cell_file(options.cell);
  if (const auto* faults = std::get_if<files::Faults>(&cell)) {
    std::fprintf(stderr, "%s\n", files::text(*faults).c_str());
    return std::nullopt;
  }
  auto scene = sim::read_scene(options.scene, std::get<files::CellConfig>(cell), options.seed);
  if (const auto* faults = std::get_if<files::Faults>(&scene)) {
    std::fprintf(stderr, "%s\n", files::text(*faults).c_str());
    return std::nullopt;
  }
  sim::Scene out = std::get<sim::Scene>(std::move(scene));
  out.faults.insert(out.faults.end(), options.faults.begin(), options.faults.end());
  return out;
}

}  // namespace

int main(int count, char** words) {
  if (count == 2 && (std::strcmp(words[1], "--help") == 0 || std::strcmp(words[1], "-h") == 0)) {
    std::fputs(kUsage, stdout);
    return 0;
  }
  if (count == 3 && std::strcmp(words[1], "--make-certificate") == 0) {
    const auto kept = sim::TlsIdentity::keep(words[2]);
    if (!kept.ok()) std::fprintf(stderr, "weldcell-sim: %s\n", kept.error().text().c_str());
    if (kept.ok()) std::printf("%s\n", kept->fingerprint().c_str());
    return kept.ok() ? 0 : 2;
  }
  const auto options = parse(count, words);
  if (!options) return 2;
  const auto scene = read(*options);
  if (!scene) return 2;

  std::signal(SIGTERM, [](int) { stop_asked = true; });
  std::signal(SIGINT, [](int) { stop_asked = true; });
  std::signal(SIGPIPE, SIG_IGN);
  try {
    sim::LiveCell cell(*scene, options->live);
    if (!options->ports_file.empty()) std::ofstream(options->ports_file) << cell.ports_json() << '\n';
    std::fprintf(stderr, "weldcell-sim: scene %s, seed %llu, %s\n", scene->name.c_str(),
                 static_cast<unsigned long long>(scene->seed), cell.ports_json().c_str());
    cell.run(stop_asked);
  } catch (const std::exception& fault) {
    std::fprintf(stderr, "weldcell-sim: %s\n", fault.what());
    return 3;
  }
  return 0;
}
