// Random numbers that depend only on what they belong to: same seed and index, same number, in any order of
// asking. Pure.
#pragma once

#include <cmath>
#include <cstdint>

namespace weldcell::sim {

/// splitmix64's finalizer.
constexpr std::uint64_t mixed(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31);
}
constexpr std::uint64_t mixed(std::uint64_t seed, std::uint64_t index, std::uint64_t purpose) {
  return mixed(seed ^ mixed(index ^ mixed(purpose)));
}
/// [0, 1)
constexpr double uniform(std::uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1.0p-53; }
/// Normal, from the sum of four 16-bit parts (tails end at 3.4 sigma).
constexpr double normal(std::uint64_t bits) {
  const double sum =
      static_cast<double>((bits & 0xFFFF) + ((bits >> 16) & 0xFFFF) + ((bits >> 32) & 0xFFFF) + (bits >> 48));
  return (sum / 65535.0 - 2.0) * 1.7320508075688772;
}

}  // namespace weldcell::sim
