#include "wire/crc32.hpp"

#include <array>

namespace weldcell::wire {
namespace {

constexpr std::uint32_t kPolynomial = 0xEDB88320;

/// table[k][b]: the checksum's change by byte b with k zero bytes behind it.
constexpr auto make_tables() {
  std::array<std::array<std::uint32_t, 256>, 8> tables{};
  for (std::uint32_t b = 0; b < 256; ++b) {
    std::uint32_t c = b;
    for (int bit = 0; bit < 8; ++bit) c = (c >> 1) ^ ((c & 1) != 0 ? kPolynomial : 0);
    tables[0][b] = c;
  }
  for (std::size_t k = 1; k < 8; ++k) {
    for (std::size_t b = 0; b < 256; ++b) {
      tables[k][b] = (tables[k - 1][b] >> 8) ^ tables[0][tables[k - 1][b] & 0xFF];
    }
  }
  return tables;
}

constexpr auto kTables = make_tables();

std::uint32_t octet(std::byte b) { return static_cast<std::uint32_t>(b); }

}  // namespace

std::uint32_t crc32(std::span<const std::byte> bytes, std::uint32_t so_far) noexcept {
  std::uint32_t c = ~so_far;
  const std::byte* p = bytes.data();
  std::size_t left = bytes.size();
  for (; left >= 8; left -= 8, p += 8) {
    const std::uint32_t low = c ^ (octet(p[0]) | octet(p[1]) << 8 | octet(p[2]) << 16 | octet(p[3]) << 24);
    c = kTables[7][low & 0xFF] ^ kTables[6][low >> 8 & 0xFF] ^ kTables[5][low >> 16 & 0xFF] ^
        kTables[4][low >> 24] ^ kTables[3][octet(p[4])] ^ kTables[2][octet(p[5])] ^ kTables[1][octet(p[6])] ^
        kTables[0][octet(p[7])];
  }
  for (; left > 0; --left, ++p) c = (c >> 8) ^ kTables[0][(c ^ octet(*p)) & 0xFF];
  return ~c;
}

}  // namespace weldcell::wire
