// Where the program's own files lie: beside the executable in a build or source tree, or installed under
// /usr/share.
#pragma once

#include <optional>
#include <string>

#include "weldcell/base/result.hpp"

namespace weldcell::app {

/// Folder of the running executable.
std::string program_dir();
/// weldcell-cad beside this program.
std::string cad_program();
/// A file below config/: from the source tree that this build came from, else from the installed share. Empty
/// when absent.
std::string shared_file(const std::string& relative);
Result<std::string> read_file(const std::string& path);
/// The text of a file below config/, looked for as above; the error names the file and the places.
Result<std::string> read_shared_file(const std::string& relative);
/// Writes beside the path, syncs and renames, so that the file is never half; owner and mode of a file that
/// stood there stay.
Status write_file_durably(const std::string& path, const std::string& text);

}  // namespace weldcell::app
