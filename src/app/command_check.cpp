// weldcell check: cell, workpiece and job files, every fault at once.
#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "app/command_line.hpp"
#include "app/places.hpp"
#include "weldcell/adapters/cad_child.hpp"
#include "weldcell/files/cell_file.hpp"
#include "weldcell/files/check.hpp"

namespace weldcell::app {

namespace {

namespace fs = std::filesystem;

/// What the job's CAD file says, through the CAD reader.
void check_cad(const std::string& job_file, const files::Checked& checked, files::Faults& faults) {
  if (checked.cad_file.empty()) return;
  const auto imported = adapters::import_cad_yaml(cad_program(), checked.cad_file, checked.cad, "");
  if (imported.ok()) return;
  faults.push_back({job_file, checked.workpiece_line, "workpiece", imported.error().text(), ""});
}

}  // namespace

int command_check(Arguments arguments) {
  CommandLine line(arguments,
                   "usage: weldcell check FILE...\n"
                   "Cell, workpiece, job and arm files: every fault as file:line: key: what: how to mend. A "
                   "job's workpiece or\n"
                   "CAD file is read too. Exit code 0: all sound; 2: faults; 78: faults in a cell file.\n",
                   {}, {"quiet"});
  if (line.exit_code()) return *line.exit_code();
  if (line.plain().empty()) return line.refuse("check wants files");
  int code = 0;
  for (const std::string& file : line.plain()) {
    files::Checked checked = files::check_file(file);
    if (checked.faults.empty()) check_cad(file, checked, checked.faults);
    std::fputs(files::text(checked.faults).c_str(), stderr);
    if (checked.faults.empty()) {
      if (!line.has("quiet")) std::printf("%s: %s, sound\n", file.c_str(), files::kind_word(checked.kind));
    } else {
      code = std::max(code, checked.kind == files::FileKind::Cell ? 78 : 2);
    }
  }
  return code;
}

}  // namespace weldcell::app
