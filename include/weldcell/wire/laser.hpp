// Laser bytes -> readings. MEAS-28 (optoNCDT 2300 and kin): any split, resynchronizing, losses counted. Pure,
// allocation-free.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "weldcell/wire/laser_window.hpp"

namespace weldcell::wire {

/// Words from here upwards are no distances but the sensor's reasons for having none.
inline constexpr std::uint32_t kLaserFirstErrorCode = 0x7FFFFF00;
/// A word beyond a Meas32 channel's scale by more than 1 % of it: a broken current loop, or no target.
inline constexpr std::uint32_t kLaserBelowScale = 0x7FFFFFE0, kLaserAboveScale = 0x7FFFFFE1;

/// One reading. Error codes of the sensor are kept as evidence.
struct LaserReading {
  float distance_mm = 0;  ///< 0 at the start of the measuring range; undefined when code != 0
  std::uint32_t code =
      0;  ///< 0 = valid, else the sensor's error word as sent (0x7FFFFF00.., 16370.., 262073..)
  std::uint32_t counter =
      0;  ///< running number of the reading, unwrapped modulo 2^32 from the first 24 bits seen
  std::uint32_t timestamp_us = 0;  ///< device clock; wraps; 0 when the stream has none
};

/// What the sensor's error word means, for events and reports; "unknown" for others.
const char* laser_code_text(std::uint32_t code);

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

/// Stream decoder. feed() takes any split of the byte stream and calls sink(const LaserReading&) per reading.
///
/// A frame whose running count is wrong is passed over where a frame behind it, or the next header, is where
/// it belongs; else the block is dropped from there on. Without the counter, missing bytes can take the
/// following block along.
class Meas28Decoder : public LaserWindow<Meas28Decoder, 4096> {
 public:
  explicit Meas28Decoder(Meas28Layout layout) : layout_(layout), frame_bytes_(layout.frame_bytes()) {}
  /// Forgets stream and numbering, for a new connection; the counters go on.
  void reset();

 private:
  friend LaserWindow;
  struct Header {
    std::uint16_t frames = 0;
    std::uint32_t counter = 0;
  };
  /// Which of the two u16 of a header counts the frames; manuals disagree, so the stream decides.
  enum class SizeOrder : std::uint8_t { Unknown, FramesFirst, BytesFirst };

  static constexpr std::size_t header_bytes() { return 28; }
  bool header_here() noexcept;
  Step take_header() noexcept;
  Step take_frame(LaserReading& out) noexcept;
  bool followers_agree(std::uint32_t& number) const noexcept;
  Step pass_damaged_frame(std::uint32_t expected) noexcept;
  /// Needs 28 bytes. True when the window begins with a header of this layout.
  bool read_header(Header& out) noexcept;
  bool accept_number(std::uint32_t word, std::uint32_t& number) noexcept;
  std::uint32_t unwrap(std::uint32_t number, std::uint32_t mask) noexcept;

  Meas28Layout layout_;
  std::size_t frame_bytes_;
  SizeOrder size_order_ = SizeOrder::Unknown;
  Header block_;
  std::uint32_t next_counter_ = 0;
  bool numbering_ = false;    ///< next_counter_ is known
  std::uint32_t offset_ = 0;  ///< frame count minus header count, modulo 2^24
  std::uint32_t rival_offset_ = 0;
  bool offset_known_ = false, offset_confirmed_ = false, rival_known_ = false;
};

/// The sensor's side, for simulators and golden tests: one block of readings with the given order and serial
/// number. Frame count before frame size; the header's counter is the first reading's. Returns the bytes
/// written, 0 when they do not fit or there are none or more than 65535 readings.
std::size_t encode_meas28(const Meas28Layout& layout, std::span<const LaserReading> readings,
                          std::uint32_t order_number, std::uint32_t serial_number,
                          std::span<std::byte> out) noexcept;

}  // namespace weldcell::wire
