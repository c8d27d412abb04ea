// Checks a file of any kind by its top key, and what it names. Reads files; any thread but the real-time
// ones.
#pragma once

#include <string>

#include "weldcell/files/document.hpp"
#include "weldcell/job/job_order.hpp"

namespace weldcell::files {

struct Checked {
  FileKind kind = FileKind::Unknown;
  Faults faults;         ///< empty: sound
  std::string cad_file;  ///< of a sound job that names a CAD file: its path, to be read by the caller
  job::CadImport cad;
  int workpiece_line = 0;  ///< where the job names it
};

/// Reads the file; a job's workpiece file beside it is read too, a cell's password file must be there.
Checked check_file(const std::string& path);

/// "cell", "workpiece", ...
const char* kind_word(FileKind kind);

}  // namespace weldcell::files
