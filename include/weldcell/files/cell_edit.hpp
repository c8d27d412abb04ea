// Changes single keys of one section of a YAML file and leaves every other byte, comments included. No file.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "weldcell/base/result.hpp"

namespace weldcell::files {

/// Sets `key: value` (value as YAML, on one line) in the top-level section: a key that stands gets the new
/// value and keeps its comment, a new one is put behind the section's last changed key, else at the section's
/// head. Errors "cell.edit": no such section, the section is written in braces, or a value goes over several
/// lines.
Result<std::string> with_keys(const std::string& text, const std::string& section,
                              const std::vector<std::pair<std::string, std::string>>& values);

}  // namespace weldcell::files
