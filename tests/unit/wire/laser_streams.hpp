// Byte streams of every laser dialect, written from the protocol descriptions, for tests and benches.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "weldcell/wire/laser_dialects.hpp"

namespace weldcell::wire::streams {

using Stream = std::vector<std::byte>;

inline LaserFormat format_of(LaserDialect dialect) {
  LaserFormat f;
  f.dialect = dialect;
  f.range_mm = 100;
  f.rate_hz = 10000;
  if (dialect == LaserDialect::Data28) f.words = 3, f.distance_word = 1, f.timestamp_word = 2;
  if (dialect == LaserDialect::Meas32) {
    f.words = 2, f.distance_word = 1;
    f.range_mm = 50, f.offset_mm = 35, f.raw_min = 15853, f.raw_max = 3261;
  }
  if (dialect == LaserDialect::Od5000) f.words = 2;
  return f;
}

inline void put(Stream& s, std::uint32_t value, std::size_t bytes, bool big = false) {
  for (std::size_t i = 0; i < bytes; ++i) {
    s.push_back(static_cast<std::byte>(value >> 8 * (big ? bytes - 1 - i : i) & 0xFF));
  }
}

/// One block (block dialects) or so many readings (byte dialects) from a number on.
inline void put_block(Stream& s, LaserDialect dialect, std::uint32_t from, std::uint32_t frames) {
  const bool od = dialect == LaserDialect::Od5000;
  if (dialect == LaserDialect::Data28) {
    for (const std::uint32_t v : {0x41544144U, 1U, 2U, 0U, 12U, frames, from}) put(s, v, 4);
  } else if (dialect == LaserDialect::Meas28) {
    for (const std::uint32_t v : {0x4D454153U, 1U, 2U, 0x18U, 0U, frames | 12U << 16, from}) put(s, v, 4);
  } else if (dialect == LaserDialect::Meas32) {
    for (const std::uint32_t v : {0x4D454153U, 1U, 2U, 5U, 0U, 0U, frames | 8U << 16, from}) put(s, v, 4);
  } else if (od) {
    put(s, 0xD000 | (12 + 8 * frames), 2, true);
    put(s, 0x40000401, 4, true);
    put(s, static_cast<std::uint32_t>(std::uint64_t{from + 500000} * 100'000 % 1'000'000'000), 4, true);
    put(s, from, 4, true);
  }
  for (std::uint32_t n = from; n != from + frames; ++n) {
    const bool bad = n % 7 == 3;
    if (dialect == LaserDialect::Data28) {
      put(s, 0x200, 4);
      put(s, bad ? 0x7FFFFF05 : 20'000'000 + n % 1000 * 1000, 4);
      put(s, n * 100, 4);
    } else if (dialect == LaserDialect::Meas28) {
      put(s, n & 0xFFFFFF, 4);
      put(s, n * 100, 4);
      put(s, bad ? 0x7FFFFFFA : 20'000'000 + n % 1000 * 1000, 4);
    } else if (dialect == LaserDialect::Meas32) {
      put(s, 0x1111, 4);
      put(s, bad ? 100 : 4000 + n % 9000, 4);
    } else if (od) {
      put(s, bad ? 0x7FFFFFFF : 15'000'000 + n % 1000, 4, true);
      put(s, 5, 4, true);
    } else if (dialect == LaserDialect::TwoByte) {
      const std::uint32_t raw = bad ? 16374 : 200 + n % 16000;
      put(s, 0x80 | raw >> 7, 1);
      put(s, raw & 0x7F, 1);
    } else {
      const std::uint32_t raw = bad ? 262077 : 700 + n % 64000;
      put(s, raw & 0x3F, 1);
      put(s, 0x40 | (raw >> 6 & 0x3F), 1);
      put(s, 0x80 | raw >> 12, 1);
    }
  }
}

inline Stream blocks(LaserDialect dialect, std::uint32_t from, std::uint32_t count,
                     std::uint32_t frames = 5) {
  Stream s;
  for (std::uint32_t b = 0; b < count; ++b) put_block(s, dialect, from + b * frames, frames);
  return s;
}

/// Feeds blocks of one size as they would arrive: a datagram each of Od5000, the whole stream of the others.
template <typename Decoder, typename Sink>
void feed_blocks(Decoder& decoder, LaserDialect dialect, std::span<const std::byte> stream, std::size_t block,
                 Sink&& sink) {
  if (dialect != LaserDialect::Od5000) return decoder.feed(stream, sink);
  for (std::size_t at = 0; at < stream.size(); at += block) {
    decoder.feed(stream.subspan(at, std::min(block, stream.size() - at)), sink);
  }
}

}  // namespace weldcell::wire::streams
