// weldcell submit, status, jobs, show, operate: the daemon's spool and control socket from the command line.
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "app/command_line.hpp"
#include "app/places.hpp"
#include "weldcell/adapters/control_socket.hpp"
#include "weldcell/adapters/spool_dir.hpp"
#include "weldcell/files/cell_file.hpp"

namespace weldcell::app {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kConfigHelp =
    "  --config CELL   the daemon's cell file (default /etc/weldcell/cell.yaml)\n";

std::optional<files::CellConfig> config_of(const CommandLine& line) {
  auto read = files::read_cell_file(line.value("config", "/etc/weldcell/cell.yaml"));
  if (const auto* faults = std::get_if<files::Faults>(&read)) {
    std::fprintf(stderr, "%s\n", files::text(*faults).c_str());
    return std::nullopt;
  }
  return std::get<files::CellConfig>(std::move(read));
}

/// Exit code; the answer in `out`.
int ask(const files::CellConfig& config, const json& question, json& out) {
  const auto answer =
      adapters::control_request(config.state_dir + "/weldcelld.sock", question.dump(), 3 * kSecond);
  if (!answer.ok()) {
    std::fprintf(stderr, "%s\n", answer.error().text().c_str());
    return 3;
  }
  out = json::parse(*answer, nullptr, false);
  return 0;
}

void print_status(const json& s) {
  std::printf("%s%s", s.value("state", "?").c_str(), s.value("armed", false) ? ", armed" : ", not armed");
  if (!s.value("job", "").empty()) std::printf(", job %s", s.value("job", "").c_str());
  if (s.value("guide_step", 0) > 0)
    std::printf(", place member %d of %d and confirm", s.value("guide_step", 0), s.value("guide_steps", 0));
  if (s.value("state", "") == "Scanning" || s.value("state", "") == "Welding")
    std::printf(", %.0f %%", 100 * s.value("progress", 0.0));
  std::printf("\nlinks:");
  for (const auto& [name, up] : s.value("links", json::object()).items())
    std::printf("  %s %s", name.c_str(), up.get<bool>() ? "up" : "DOWN");
  if (!s.value("fault", "").empty()) std::printf("\nfault: %s", s.value("fault", "").c_str());
  std::printf("\n");
}

}  // namespace

int command_submit(Arguments arguments) {
  CommandLine line(
      arguments,
      std::string("usage: weldcell submit JOB.yaml [FILE...] [--config CELL | --spool DIR]\n"
                  "Drops the job with its workpiece or CAD files into the spool, all or nothing.\n") +
          kConfigHelp,
      {"config", "spool"}, {});
  if (line.exit_code()) return *line.exit_code();
  if (line.plain().empty()) return line.refuse("submit wants a job file");
  std::string spool = line.value("spool");
  if (spool.empty()) {
    const auto config = config_of(line);
    if (!config) return 2;
    spool = config->spool_dir;
  }
  std::vector<fs::path> files(line.plain().begin() + 1, line.plain().end());
  const auto dropped = adapters::submit_job(spool, line.plain()[0], files);
  if (!dropped.ok()) {
    std::fprintf(stderr, "%s\n", dropped.error().text().c_str());
    return 2;
  }
  std::printf("%s\n", dropped->c_str());
  return 0;
}

int command_status(Arguments arguments) {
  CommandLine line(arguments,
                   std::string("usage: weldcell status [--watch] [--json] [--config CELL]\n") + kConfigHelp,
                   {"config"}, {"watch", "json"});
  if (line.exit_code()) return *line.exit_code();
  const auto config = config_of(line);
  if (!config) return 2;
  do {
    json status;
    if (const int code = ask(*config, {{"command", "status"}}, status); code != 0) return code;
    if (line.has("json")) {
      std::printf("%s\n", status.dump().c_str());
    } else {
      print_status(status);
    }
    std::fflush(stdout);
    if (line.has("watch")) std::this_thread::sleep_for(std::chrono::seconds(1));
  } while (line.has("watch"));
  return 0;
}

int command_jobs(Arguments arguments) {
  CommandLine line(arguments, std::string("usage: weldcell jobs [--json] [--config CELL]\n") + kConfigHelp,
                   {"config"}, {"json"});
  if (line.exit_code()) return *line.exit_code();
  const auto config = config_of(line);
  if (!config) return 2;
  json out = json::array();
  for (const char* place : {"incoming", "active", "done", "failed", "rejected"}) {
    std::error_code error;
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(fs::path(config->spool_dir) / place, error)) {
      const std::string name = entry.path().filename().string();
      if (!name.starts_with(".")) names.push_back(name);
    }
    std::sort(names.begin(), names.end());
    for (const std::string& name : names) {
      if (line.has("json")) {
        out.push_back({{"place", place}, {"name", name}});
      } else {
        std::printf("%-9s %s\n", place, name.c_str());
      }
    }
  }
  if (line.has("json")) std::printf("%s\n", json{{"jobs", out}}.dump().c_str());
  return 0;
}

int command_show(Arguments arguments) {
  CommandLine line(
      arguments,
      std::string("usage: weldcell show JOB [--config CELL]\nIts result, and where its files lie.\n") +
          kConfigHelp,
      {"config"}, {});
  if (line.exit_code()) return *line.exit_code();
  if (line.plain().size() != 1) return line.refuse("show wants a job's name");
  const auto config = config_of(line);
  if (!config) return 2;
  for (const char* place : {"active", "done", "failed", "rejected", "incoming"}) {
    const fs::path folder = fs::path(config->spool_dir) / place / line.plain()[0];
    std::error_code error;
    if (!fs::exists(folder, error)) continue;
    std::printf("%s: %s\n", place, folder.c_str());
    for (const auto& entry : fs::directory_iterator(folder, error))
      std::printf("  %s\n", entry.path().filename().c_str());
    const auto result = read_file((folder / "result.json").string());
    if (result.ok()) std::printf("%s\n", result->c_str());
    const auto reason = read_file(folder.string() + ".reason");
    if (reason.ok()) std::printf("%s\n", reason->c_str());
    return 0;
  }
  std::fprintf(stderr, "no job '%s' in %s: weldcell jobs lists them\n", line.plain()[0].c_str(),
               config->spool_dir.c_str());
  return 2;
}

int command_operate(Arguments arguments) {
  CommandLine line(arguments,
                   std::string("usage: weldcell operate "
                               "arm|start|confirm|stop|hold|unhold|resume|clear|reset|abort [--config CELL]\n"
                               "What an operator may order. Nothing moves before 'arm'.\n") +
                       kConfigHelp,
                   {"config"}, {});
  if (line.exit_code()) return *line.exit_code();
  if (line.plain().size() != 1) return line.refuse("operate wants one order");
  const auto config = config_of(line);
  if (!config) return 2;
  json answer;
  if (const int code = ask(*config, {{"command", line.plain()[0]}}, answer); code != 0) return code;
  if (!answer.value("ok", false)) {
    std::fprintf(stderr, "%s\n", answer.value("error", "refused").c_str());
    return 1;
  }
  return 0;
}

}  // namespace weldcell::app
