// Scalars as YAML writes them. Pure.
#pragma once

#include <string>

namespace weldcell::files {

/// Plain where that is safe, else in double quotes. One line of text without control characters.
std::string yaml_text(const std::string& text);
/// Always in double quotes.
std::string yaml_quoted(const std::string& text);
/// At most 6 decimals, no trailing zeros, never "-0". The number must be finite.
std::string yaml_number(double value);

}  // namespace weldcell::files
