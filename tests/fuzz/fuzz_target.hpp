// What a fuzz target is made of: the entry point, and checks that end the program in every build.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "weldcell/base/assert.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace weldcell::fuzz {

inline std::span<const std::byte> bytes(const std::uint8_t* data, std::size_t size) {
  return std::as_bytes(std::span(data, size));
}

}  // namespace weldcell::fuzz
