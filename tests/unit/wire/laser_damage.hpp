// One byte in a hundred damaged: what a decoder loses beside the damaged frames. For tests and benches.
#pragma once

#include <random>

#include "unit/wire/laser_streams.hpp"

namespace weldcell::wire::streams {

struct Damage {
  std::size_t sent = 0, sound = 0;  ///< readings; those whose bytes, and whose header, are whole
  std::size_t sound_lost = 0;
  std::uint64_t resyncs = 0;
};

/// 2000 blocks of 5 readings (byte dialects: 2000 readings). A frame with a bad byte is damaged, and the
/// whole block when its header has one.
inline Damage damage(LaserDialect dialect, unsigned seed) {
  std::mt19937 random(seed);
  const bool counts = dialect != LaserDialect::TwoByte && dialect != LaserDialect::ThreeByte;
  const LaserFormat format = format_of(dialect);
  const std::uint32_t blocks = 2000, frames = counts ? 5 : 1, first = counts ? 1000 : 0;
  Stream s;
  std::vector<std::size_t> starts;
  for (std::uint32_t b = 0; b < blocks; ++b) {
    starts.push_back(s.size());
    put_block(s, dialect, 1000 + b * frames, frames);
  }
  starts.push_back(s.size());
  const auto decode = [&](std::uint64_t* resyncs) {
    std::vector<LaserReading> out;
    LaserDecoder decoder(format);
    feed_blocks(decoder, dialect, s, starts[1], [&](const LaserReading& r) { out.push_back(r); });
    if (resyncs != nullptr) *resyncs = decoder.counters().resyncs;
    return out;
  };
  const auto clean = decode(nullptr);
  Damage out;
  out.sent = std::size_t{blocks} * frames;
  if (clean.size() != out.sent) return out;

  const std::size_t frame_bytes = !counts                           ? starts[1]
                                  : dialect == LaserDialect::Meas28 ? format.meas28.frame_bytes()
                                                                    : 4 * format.words;
  std::vector<bool> damaged(clean.size());
  for (std::uint32_t b = 0; b < blocks; ++b) {
    const std::size_t header = starts[b + 1] - starts[b] - frames * frame_bytes;
    for (std::size_t i = starts[b]; i < starts[b + 1]; ++i) {
      if (random() % 100 != 0) continue;
      s[i] ^= static_cast<std::byte>(1 + random() % 255);
      const std::size_t in = i - starts[b];
      for (std::uint32_t k = 0; k < frames; ++k) {
        if (in < header || (in - header) / frame_bytes == k) damaged[b * frames + k] = true;
      }
    }
  }
  const auto read = decode(&out.resyncs);
  // In order, so that every sound reading is found again by its values (and number, where the wire counts).
  std::vector<std::vector<LaserReading>> by_number(clean.size() + 100);
  for (const auto& r : read) {
    if (r.counter - first < by_number.size()) by_number[r.counter - first].push_back(r);
  }
  const auto alike = [](const LaserReading& a, const LaserReading& b) {
    return a.code == b.code && a.distance_mm == b.distance_mm;
  };
  std::size_t behind = 0;
  for (std::size_t i = 0; i < clean.size(); ++i) {
    if (damaged[i]) continue;
    ++out.sound;
    bool found = false;
    if (counts) {
      for (const auto& r : by_number[i])
        found = found || (alike(r, clean[i]) && r.counter == clean[i].counter &&
                          r.timestamp_us == clean[i].timestamp_us);
    } else {
      for (std::size_t k = behind; k < std::min(read.size(), behind + 40) && !found; ++k) {
        found = alike(read[k], clean[i]);
        if (found) behind = k + 1;
      }
    }
    if (!found) ++out.sound_lost;
  }
  return out;
}

}  // namespace weldcell::wire::streams
