// Laser bytes -> readings for every dialect beside MEAS-28, and one decoder over all. Pure, allocation-free.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <variant>

#include "weldcell/wire/laser.hpp"

namespace weldcell::wire {

enum class LaserDialect : std::uint8_t {
  Meas28,     ///< optoNCDT 2300, confocalDT IFC2451/61/71, C-Box
  Data28,     ///< confocalDT IFC2421/2422
  Meas32,     ///< IF1032/ETH, capaNCDT 62x0
  TwoByte,    ///< optoNCDT 1402, RS422 behind a serial device server
  ThreeByte,  ///< optoNCDT 1220/1320/1420, RS422 behind a serial device server; distance alone
  Od5000,     ///< SICK OD5000 and Optex CDX, UDP push
};

/// As the cell file writes it: "meas28", "data28", ...
const char* to_string(LaserDialect dialect);

/// What the bytes alone do not say. docs/LASERS.md lists what each dialect needs.
struct LaserFormat {
  LaserDialect dialect = LaserDialect::Meas28;
  Meas28Layout meas28;            ///< Meas28 only
  double range_mm = 0;            ///< length of the measuring range: TwoByte, ThreeByte, Meas32
  double rate_hz = 0;             ///< readings a second: Od5000, for the stamps inside a packet
  std::size_t words = 1;          ///< 32-bit words a frame: Data28 items, Meas32 and Od5000 channels
  std::size_t distance_word = 0;  ///< which of them is the distance
  int timestamp_word = -1;        ///< Data28: which of them is the device clock in us; -1 none
  double raw_min = 0;             ///< Meas32: word at offset_mm; may lie above raw_max
  double raw_max = 0xFFFFFF;      ///< Meas32: word at offset_mm + range_mm
  double offset_mm = 0;           ///< Meas32
};

/// Why a format cannot be decoded, with the mend; nullptr when it can.
const char* laser_format_fault(const LaserFormat& format);

/// Data28 and Meas32: a stream of blocks, a header that counts and then frames of 32-bit words.
///
/// Nothing inside a frame tells damage, so a damaged frame reads as another value. A block whose header does
/// not go on from the one before is dropped unless bytes were missing before it; the next block decides
/// whether the count was damaged or has jumped.
class LaserBlockDecoder : public LaserWindow<LaserBlockDecoder, 2048> {
 public:
  /// Needs a format without a fault.
  explicit LaserBlockDecoder(const LaserFormat& format);
  void reset();

 private:
  friend LaserWindow;
  struct Header {
    std::uint32_t frames = 0;
    std::uint32_t counter = 0;
  };

  std::size_t header_bytes() const noexcept { return header_bytes_; }
  bool header_here() const noexcept;
  Step take_header() noexcept;
  Step take_frame(LaserReading& out) noexcept;
  Step look_for_header() noexcept;
  bool may_be_header(const std::byte* p) const noexcept;
  bool read_header(const std::byte* p, Header& out) const noexcept;
  bool accept_count() noexcept;
  void read_frame(const std::byte* p, LaserReading& out) const noexcept;

  LaserFormat format_;
  std::size_t header_bytes_, frame_bytes_;
  bool dropping_ = false;
  Header block_;
  std::uint32_t next_counter_ = 0;
  bool numbering_ = false;
  bool settled_ = false;          ///< some header went on from the one before
  std::uint32_t rival_next_ = 0;  ///< next count if the dropped header was right
  bool rival_known_ = false;
  std::uint64_t trusted_place_ = 0;
  std::uint32_t trusted_counter_ = 0;  ///< of the last header that went on from the one before
  bool doubted_ = false;               ///< the last header accepted did not go on from one before
};

/// Od5000: every feed() is one datagram. A datagram whose length, count and stamp do not agree with each
/// other and with those before is dropped alone; two in a row that go on from each other are a restarted
/// sensor.
class LaserDatagramDecoder {
 public:
  /// Needs a format without a fault.
  explicit LaserDatagramDecoder(const LaserFormat& format) : format_(format) {}

  template <typename Sink>
  void feed(std::span<const std::byte> datagram, Sink&& sink) {
    const std::uint32_t readings = open(datagram);
    LaserReading reading;
    for (std::uint32_t i = 0; i < readings; ++i) {
      read(datagram, i, reading);
      sink(static_cast<const LaserReading&>(reading));
    }
  }
  const LaserCounters& counters() const { return counters_; }
  void reset();

 private:
  struct Mark {
    std::uint32_t time_ns = 0, counter = 0;  ///< of a datagram's first reading, within the device's second
    std::uint32_t us = 0;                    ///< the same on one clock of us, modulo 2^32
    bool known = false;
  };

  /// How many readings the datagram holds; 0 when it is none of the sensor's or stands in doubt.
  std::uint32_t open(std::span<const std::byte> datagram) noexcept;
  void read(std::span<const std::byte> datagram, std::uint32_t index, LaserReading& out) const noexcept;
  bool place(Mark& now, std::uint32_t readings) noexcept;
  bool follows(const Mark& from, Mark& to, double longest_us) const noexcept;

  LaserFormat format_;
  LaserCounters counters_;
  Mark mark_, older_;  ///< the last two datagrams taken
  Mark doubt_;         ///< the last one that did not go on from them
  std::uint32_t next_counter_ = 0, doubt_next_ = 0;
  bool settled_ = false;  ///< some datagram went on from the one before
};

/// TwoByte and ThreeByte: flag bits mark each byte's place, nothing counts. The running number counts the
/// readings since the start, with one for each two (three) bytes that fit nowhere: number / rate is the
/// clock. A reading whose bytes are all missing cannot be told.
class LaserByteDecoder {
 public:
  /// Needs a format without a fault.
  explicit LaserByteDecoder(const LaserFormat& format);

  template <typename Sink>
  void feed(std::span<const std::byte> bytes, Sink&& sink) {
    LaserReading reading;
    for (const std::byte byte : bytes) {
      if (take(static_cast<std::uint32_t>(byte), reading)) sink(static_cast<const LaserReading&>(reading));
    }
  }
  const LaserCounters& counters() const { return counters_; }
  void reset();

 private:
  bool take(std::uint32_t byte, LaserReading& out) noexcept;
  void skip(std::size_t bytes) noexcept;

  LaserFormat format_;
  std::size_t width_;
  LaserCounters counters_;
  std::uint32_t raw_ = 0;
  std::size_t held_ = 0;  ///< bytes of the reading under way
  std::size_t run_ = 0;   ///< bytes skipped since the last reading
  std::uint32_t next_counter_ = 0;
};

/// Any laser: feed(), counters() and reset() as every dialect's decoder has them. A stream may be fed in any
/// pieces; of Od5000 each feed() is one datagram.
class LaserDecoder {
 public:
  /// Needs a format without a fault.
  explicit LaserDecoder(const LaserFormat& format);

  template <typename Sink>
  void feed(std::span<const std::byte> bytes, Sink&& sink) {
    std::visit([&](auto& decoder) { decoder.feed(bytes, sink); }, decoder_);
  }
  const LaserCounters& counters() const;
  /// Forgets stream and numbering, for a new connection; the counters go on.
  void reset();

 private:
  std::variant<Meas28Decoder, LaserBlockDecoder, LaserByteDecoder, LaserDatagramDecoder> decoder_;
};

}  // namespace weldcell::wire
