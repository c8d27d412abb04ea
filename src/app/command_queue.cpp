// weldcell hold, release, cancel: orders about jobs that wait, kept as files in the spool.
#include <cstdio>
#include <thread>

#include "app/command_line.hpp"
#include "weldcell/adapters/spool_dir.hpp"
#include "weldcell/files/cell_file.hpp"

namespace weldcell::app {

namespace {

constexpr const char* kWhere =
    "  JOB             the job's name, its key 'job'\n"
    "  --config CELL   the daemon's cell file (default /etc/weldcell/cell.yaml)\n"
    "  --spool DIR     the spool itself, instead of a cell file\n";

/// The spool and the job that a command line names; an exit code otherwise.
struct Target {
  std::string spool, job;
  int exit_code = -1;
};

Target target_of(Arguments arguments, const char* usage) {
  CommandLine line(arguments, std::string(usage) + kWhere, {"config", "spool"}, {});
  Target out;
  if (line.exit_code()) {
    out.exit_code = *line.exit_code();
    return out;
  }
  if (line.plain().size() != 1) {
    out.exit_code = line.refuse("it wants one job's name");
    return out;
  }
  out.job = line.plain()[0];
  out.spool = line.value("spool");
  if (!out.spool.empty()) return out;
  auto read = files::read_cell_file(line.value("config", "/etc/weldcell/cell.yaml"));
  if (const auto* faults = std::get_if<files::Faults>(&read)) {
    std::fprintf(stderr, "%s\n", files::text(*faults).c_str());
    out.exit_code = 2;
    return out;
  }
  out.spool = std::get<files::CellConfig>(read).spool_dir;
  return out;
}

int mark(const Target& target, adapters::SpoolMark what) {
  const Status done = adapters::mark_job(target.spool, what, target.job);
  if (done.ok()) return 0;
  std::fprintf(stderr, "%s\n", done.error().text().c_str());
  return 2;
}

}  // namespace

int command_hold(Arguments arguments) {
  const Target target = target_of(
      arguments,
      "usage: weldcell hold JOB [--config CELL | --spool DIR]\n"
      "The job stays in the spool and lets others pass, until it is released. One already taken is not "
      "touched.\n");
  return target.exit_code >= 0 ? target.exit_code : mark(target, adapters::SpoolMark::Hold);
}

int command_release(Arguments arguments) {
  const Target target = target_of(
      arguments, "usage: weldcell release JOB [--config CELL | --spool DIR]\nTakes its hold away.\n");
  if (target.exit_code >= 0) return target.exit_code;
  if (adapters::unmark_job(target.spool, adapters::SpoolMark::Hold, target.job)) return 0;
  std::fprintf(stderr, "'%s' is not on hold in %s\n", target.job.c_str(), target.spool.c_str());
  return 1;
}

int command_cancel(Arguments arguments) {
  const Target target = target_of(
      arguments,
      "usage: weldcell cancel JOB [--config CELL | --spool DIR]\n"
      "A job that waits goes to rejected/ or failed/, one under way is aborted. Nothing is deleted.\n");
  if (target.exit_code >= 0) return target.exit_code;
  if (const int code = mark(target, adapters::SpoolMark::Cancel); code != 0) return code;
  for (int i = 0; i < 30; ++i) {
    if (!adapters::job_marked(target.spool, adapters::SpoolMark::Cancel, target.job)) return 0;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  std::fprintf(stderr, "noted; the daemon does it as soon as it sees the job\n");
  return 0;
}

}  // namespace weldcell::app
