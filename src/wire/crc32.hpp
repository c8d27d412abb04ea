// CRC-32 of ISO 3309 (the one of zlib and PNG), eight bytes a step. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace weldcell::wire {

/// Continues a checksum; begin with 0.
std::uint32_t crc32(std::span<const std::byte> bytes, std::uint32_t so_far = 0) noexcept;

}  // namespace weldcell::wire
