// weldcell: the cell controller's core from the command line.
#include <cstdio>
#include <cstring>
#include <exception>
#include <string>
#include <vector>

#include "app/commands.hpp"
#include "weldcell/files/schema.hpp"

namespace {

using weldcell::app::Arguments;

struct Command {
  const char* name;
  int (*run)(Arguments);
  const char* line;
};

constexpr Command kCommands[] = {
    {"check", weldcell::app::command_check,
     "check cell, workpiece and job files: every fault with line and mend"},
    {"import", weldcell::app::command_import, "STEP or DXF -> workpiece.yaml"},
    {"plan", weldcell::app::command_plan, "what a job would do: guidance, scan, reach, times; no motion"},
    {"localize", weldcell::app::command_localize, "edge points -> pose, covariance, verdict"},
    {"trials", weldcell::app::command_trials, "seeded virtual jobs through the whole chain, in virtual time"},
    {"replay", weldcell::app::command_replay, "run a record again and compare to the bit"},
    {"review", weldcell::app::command_review, "a record as one self-contained page"},
    {"dump", weldcell::app::command_dump, "a record's topic as CSV or JSON lines"},
    {"calibrate", weldcell::app::command_calibrate,
     "latency from passes to and fro: residuals, covariance, cell file"},
    {"arm", weldcell::app::command_arm, "joints <-> tool0 poses of an arm model, as CSV"},
    {"rapid", weldcell::app::command_rapid, "RAPID modules and configuration rows for the robot controller"},
    {"submit", weldcell::app::command_submit, "drop a job into the spool"},
    {"status", weldcell::app::command_status, "what the daemon does now"},
    {"jobs", weldcell::app::command_jobs, "the jobs in the spool"},
    {"show", weldcell::app::command_show, "one job: verdict, result, files"},
    {"hold", weldcell::app::command_hold, "a waiting job stays in the spool until it is released"},
    {"release", weldcell::app::command_release, "takes the hold away"},
    {"cancel", weldcell::app::command_cancel, "a waiting job is rejected, one under way is aborted"},
    {"operate", weldcell::app::command_operate,
     "arm | start | confirm | stop | hold | unhold | resume | clear | reset | abort"},
    {"plc-check", weldcell::app::command_plc_check, "does a Modbus server, or a PLC, keep to docs/PLC.md?"},
    {"migrate", weldcell::app::command_migrate, "a cell file of an older version -> today's, comments kept"},
    {"doctor", weldcell::app::command_doctor, "is this machine fit: real time, network, ports, disks, clock"},
};

int usage(std::FILE* to) {
  std::fputs("usage: weldcell COMMAND [ARGUMENT...]     weldcell COMMAND --help\n\n", to);
  for (const Command& command : kCommands) std::fprintf(to, "  %-10s %s\n", command.name, command.line);
  std::fputs(
      "\nexit codes: 0 done, 1 done but not accepted, 2 bad input or usage, 3 device or system fault\n", to);
  return to == stdout ? 0 : 2;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return usage(stderr);
  if (std::strcmp(argv[1], "--help") == 0 || std::strcmp(argv[1], "-h") == 0 ||
      std::strcmp(argv[1], "help") == 0) {
    return usage(stdout);
  }
  if (std::strcmp(argv[1], "--version") == 0) {
    std::puts("weldcell " WELDCELL_VERSION);
    return 0;
  }
  try {
    for (const Command& command : kCommands) {
      if (std::strcmp(argv[1], command.name) == 0) {
        return command.run(
            Arguments(const_cast<const char* const*>(argv) + 2, static_cast<std::size_t>(argc - 2)));
      }
    }
  } catch (const std::exception& fault) {
    std::fprintf(stderr, "weldcell %s: %s\n", argv[1], fault.what());
    return 3;
  }
  std::vector<std::string> known;
  for (const Command& command : kCommands) known.emplace_back(command.name);
  const std::string near = weldcell::files::nearest_word(argv[1], known);
  if (near.empty()) {
    std::fprintf(stderr, "weldcell: unknown command '%s'\n\n", argv[1]);
    return usage(stderr);
  }
  std::fprintf(stderr, "weldcell: unknown command '%s': did you mean '%s'?\n", argv[1], near.c_str());
  return 2;
}
