// Laser bytes -> readings. MEAS-28 (optoNCDT 2300 and kin): any split, resynchronizing, losses counted. Pure,
// allocation-free.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace weldcell::wire {

/// One reading. Error codes of the sensor are kept as evidence.
struct LaserReading {
  float distance_mm = 0;            ///< 0 at the start of the measuring range; undefined when code != 0
  std::uint32_t code = 0;           ///< 0 = valid, else the sensor's error word (0x7FFFFFF5..0x7FFFFFFB)
  std::uint32_t counter = 0;        ///< running number of the reading, unwrapped modulo 2^32
  std::uint32_t timestamp_us = 0;   ///< device clock; wraps; 0 when the stream has none
};

/// Which items a MEAS frame carries, in the sensor's fixed order. Must equal the sensor's output selection.
struct Meas28Layout {
  bool exposure = false;
  bool counter = true;
  bool timestamp = true;
  bool intensity = false;
  bool status = false;
  /// Bytes of one frame: 4 for each item selected plus 4 for the distance.
  std::size_t frame_bytes() const;
};

struct LaserCounters {
  std::uint64_t blocks = 0, readings = 0, lost_readings = 0, resyncs = 0, skipped_bytes = 0;
};

/// Stream decoder. feed() takes any split of the byte stream and calls sink(const LaserReading&) per reading.
class Meas28Decoder {
 public:
  explicit Meas28Decoder(Meas28Layout layout) : layout_(layout) {}

  template <typename Sink>
  void feed(std::span<const std::byte> bytes, Sink&& sink) {
    while (!bytes.empty()) {
      bytes = take(bytes);
      LaserReading reading;
      while (next(reading)) sink(static_cast<const LaserReading&>(reading));
    }
  }
  const LaserCounters& counters() const { return counters_; }
  void reset();

 private:
  /// Copies what fits into the buffer and returns the rest.
  std::span<const std::byte> take(std::span<const std::byte> bytes) noexcept;
  bool next(LaserReading& out) noexcept;

  Meas28Layout layout_;
  LaserCounters counters_;
  std::array<std::byte, 4096> buffer_{};
  std::size_t begin_ = 0, end_ = 0;
  std::uint16_t frames_left_ = 0;
  std::uint32_t next_counter_ = 0;
  bool seen_block_ = false;
};

/// The sensor's side, for simulators and golden tests: one block of readings with the given order and serial number.
/// Returns the bytes written, 0 when they do not fit.
std::size_t encode_meas28(const Meas28Layout& layout, std::span<const LaserReading> readings, std::uint32_t order_number,
                          std::uint32_t serial_number, std::span<std::byte> out) noexcept;

}  // namespace weldcell::wire
