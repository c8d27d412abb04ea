// WELDCELL_ASSERT: a broken invariant ends the program in every build; the robot stops by its own time-out.
// Pure.
#pragma once

namespace weldcell {
/// Prints file, line and expression to stderr and aborts.
[[noreturn]] void assertion_failed(const char* expression, const char* file, int line) noexcept;
}  // namespace weldcell

#define WELDCELL_ASSERT(expression) \
  ((expression) ? static_cast<void>(0) : ::weldcell::assertion_failed(#expression, __FILE__, __LINE__))
