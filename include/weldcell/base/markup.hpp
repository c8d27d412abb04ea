// Text that is safe inside HTML, SVG and XML. Pure.
#pragma once

#include <string>
#include <string_view>

namespace weldcell {

/// Escapes & < > " '; bytes that are no UTF-8 and control characters become U+FFFD.
std::string escaped(std::string_view text);

}  // namespace weldcell
