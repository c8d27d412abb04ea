// A guidance drawing as a PNG file: what the projector shows, for record, report and the operator page. Any
// thread.
#pragma once

#include <filesystem>

#include "weldcell/base/result.hpp"
#include "weldcell/guidance/drawing.hpp"

namespace weldcell::adapters {

/// Writes the picture (black ground, pixel for pixel what the window shows) beside the path and renames it
/// into place. Errors: "projector.size" (no or more than 8192 pixels), "projector.io".
Status write_png(const guidance::Drawing& drawing, const std::filesystem::path& path);

}  // namespace weldcell::adapters
