#include "weldcell/wire/laser.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace weldcell::wire {
namespace {

constexpr std::size_t kHeaderBytes = 28;
constexpr std::uint32_t kPreamble = 0x4D454153;
constexpr std::uint32_t kCounterMask = 0xFFFFFF;
constexpr double kMmPerCount = 1e-6;
/// Frames of a block that are looked at for the right count behind a damaged one.
constexpr std::uint32_t kLookAhead = 32;
/// A count farther ahead than this is a restarted sensor, not a loss: 3.5 minutes at 5 kHz.
constexpr std::uint32_t kLongestGap = 1U << 20;

std::uint32_t read_u32(const std::byte* p) {
  return static_cast<std::uint32_t>(p[0]) | static_cast<std::uint32_t>(p[1]) << 8 |
         static_cast<std::uint32_t>(p[2]) << 16 | static_cast<std::uint32_t>(p[3]) << 24;
}

std::uint16_t read_u16(const std::byte* p) {
  return static_cast<std::uint16_t>(static_cast<unsigned>(p[0]) | static_cast<unsigned>(p[1]) << 8);
}

std::byte* write_u32(std::byte* p, std::uint32_t value) {
  for (int shift = 0; shift < 32; shift += 8) *p++ = static_cast<std::byte>(value >> shift & 0xFF);
  return p;
}

std::byte* write_u16(std::byte* p, std::uint16_t value) {
  *p++ = static_cast<std::byte>(value & 0xFF);
  *p++ = static_cast<std::byte>(value >> 8);
  return p;
}

/// Which items are there, after the header's first word of flags.
std::uint32_t flags_of(const Meas28Layout& layout) {
  return (layout.exposure ? 1U << 2 : 0U) | (layout.counter ? 1U << 3 : 0U) |
         (layout.timestamp ? 1U << 4 : 0U) | (layout.intensity ? 1U << 8 : 0U) |
         (layout.status ? 1U << 16 : 0U);
}

std::uint32_t distance_word(const LaserReading& reading) {
  if (reading.code != 0) return reading.code;
  const double counts = std::clamp(std::round(static_cast<double>(reading.distance_mm) / kMmPerCount),
                                   static_cast<double>(std::numeric_limits<std::int32_t>::min()),
                                   static_cast<double>(kLaserFirstErrorCode - 1));
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(counts));
}

}  // namespace

const char* laser_code_text(std::uint32_t code) {
  switch (code) {
    case 0:
      return "valid";
    case 16370:
    case 262076:
    case 0x7FFFFF04:
    case 0x7FFFFFFB:
      return "no peak";
    case 16372:
    case 262077:
    case 0x7FFFFF05:
    case 0x7FFFFFFA:
      return "peak before the measuring range";
    case 16374:
    case 262078:
    case 0x7FFFFF06:
    case 0x7FFFFFF9:
      return "peak behind the measuring range";
    case 262079:
    case 262080:
    case 0x7FFFFF07:
    case 0x7FFFFFF8:
      return "measurement cannot be calculated";
    case 16376:
    case 0x7FFFFFF7:
      return "peak cannot be evaluated";
    case 262081:
    case 0x7FFFFFF6:
      return "peak too wide";
    case 16378:
    case 262082:
    case 0x7FFFFFF5:
      return "laser is off";
    case 16380:
      return "trigger too fast";
    case 262073:
      return "scaling underflow";
    case 262074:
      return "scaling overflow";
    case 262075:
      return "too much data for the baud rate";
    case 0x7FFFFF08:
      return "distance cannot be represented";
    case kLaserBelowScale:
      return "word below the channel's scale";
    case kLaserAboveScale:
      return "word above the channel's scale";
    case 0x7FFFFFFF:
      return "no value";
    default:
      return "unknown";
  }
}

std::size_t Meas28Layout::frame_bytes() const {
  return 4 * (1 + std::size_t{exposure} + std::size_t{counter} + std::size_t{timestamp} +
              std::size_t{intensity} + std::size_t{status});
}

void Meas28Decoder::reset() {
  const LaserCounters kept = counters_;
  *this = Meas28Decoder(layout_);
  counters_ = kept;
}

bool Meas28Decoder::read_header(Header& out) noexcept {
  const std::byte* p = front();
  if (read_u32(p) != kPreamble) return false;
  const std::uint16_t first = read_u16(p + 20), second = read_u16(p + 22);
  const bool frames_first = second == frame_bytes_ && size_order_ != SizeOrder::BytesFirst;
  const bool bytes_first = first == frame_bytes_ && size_order_ != SizeOrder::FramesFirst;
  if (!frames_first && !bytes_first) return false;
  if (first != second) size_order_ = frames_first ? SizeOrder::FramesFirst : SizeOrder::BytesFirst;
  out.frames = frames_first ? first : second;
  out.counter = read_u32(p + 24);
  return true;
}

bool Meas28Decoder::header_here() noexcept {
  Header header;
  return read_header(header);
}

auto Meas28Decoder::take_header() noexcept -> Step {
  if (size() < header_bytes()) return Step::NeedMore;
  if (!read_header(block_)) {
    lose_sync();
    return Step::Again;
  }
  consume(header_bytes());
  frames_left_ = block_.frames;
  ++counters_.blocks;
  if (!layout_.counter && block_.frames > 0) {
    next_counter_ = unwrap(block_.counter, std::numeric_limits<std::uint32_t>::max());
  }
  return Step::Again;
}

auto Meas28Decoder::take_frame(LaserReading& out) noexcept -> Step {
  if (size() < frame_bytes_) return Step::NeedMore;
  if (read_u32(front()) == kPreamble) {
    if (size() < header_bytes()) return Step::NeedMore;
    if (header_here()) {
      // The block before was cut short: its missing frames show in the count.
      ++counters_.resyncs;
      frames_left_ = 0;
      return Step::Again;
    }
  }
  const std::byte* p = front() + (layout_.exposure ? 4 : 0);
  std::uint32_t number = next_counter_;
  if (layout_.counter) {
    const bool first = frames_left_ == block_.frames;
    std::uint32_t outvoted = 0;
    if (first && !offset_confirmed_) {
      if (size() < std::min<std::size_t>(frames_left_, 3) * frame_bytes_) return Step::NeedMore;
      if (followers_agree(outvoted) && outvoted != read_u32(p)) return pass_damaged_frame(outvoted);
    }
    const bool rival_known = rival_known_;
    const std::uint32_t rival_offset = rival_offset_;
    if (!accept_number(read_u32(p), number)) {
      const Step step = pass_damaged_frame(first ? (block_.counter + offset_) & kCounterMask : next_counter_);
      // Looked at again when more has come, it must not be its own witness.
      if (step == Step::NeedMore) rival_known_ = rival_known, rival_offset_ = rival_offset;
      return step;
    }
    p += 4;
  }
  out = LaserReading{};
  out.counter = number;
  if (layout_.timestamp) {
    out.timestamp_us = read_u32(p);
    p += 4;
  }
  if (layout_.intensity) p += 4;
  const std::uint32_t word = read_u32(p);
  const auto counts = static_cast<std::int32_t>(word);
  if (counts >= static_cast<std::int32_t>(kLaserFirstErrorCode)) out.code = word;
  out.distance_mm = static_cast<float>(counts * kMmPerCount);
  next_counter_ = number + 1;
  numbering_ = true;
  --frames_left_;
  ++counters_.readings;
  consume(frame_bytes_);
  return Step::Reading;
}

/// The count of the frame at the front by the two behind it, where those agree.
bool Meas28Decoder::followers_agree(std::uint32_t& number) const noexcept {
  const std::size_t at = layout_.exposure ? 4 : 0;
  if (frames_left_ < 3 || size() < 2 * frame_bytes_ + at + 4) return false;
  number = (read_u32(front() + frame_bytes_ + at) - 1) & kCounterMask;
  return number == ((read_u32(front() + 2 * frame_bytes_ + at) - 2) & kCounterMask);
}

auto Meas28Decoder::pass_damaged_frame(std::uint32_t expected) noexcept -> Step {
  // Nothing but the count may be damaged: then a frame farther on in the block has the right one, or the next
  // header stands where this block ends. At the beginning of a block the header's count may be the damaged
  // one: its end tells nothing then.
  const bool first = frames_left_ == block_.frames;
  const std::size_t count_at = layout_.exposure ? 4 : 0;
  const std::uint32_t last = std::min(first ? frames_left_ - 1 : frames_left_, kLookAhead);
  bool right = false;
  for (std::uint32_t j = 1; j <= last && !right; ++j) {
    const bool end = j == frames_left_;
    const std::size_t at = j * frame_bytes_ + (end ? 0 : count_at);
    if (size() < at + 4) return Step::NeedMore;
    right = read_u32(front() + at) == (end ? kPreamble : (expected + j) & kCounterMask);
  }
  if (!right) {
    lose_sync();
    return Step::Again;
  }
  ++counters_.resyncs;
  ++counters_.lost_readings;
  counters_.skipped_bytes += frame_bytes_;
  next_counter_ = (first ? unwrap(expected, kCounterMask) : next_counter_) + 1;
  numbering_ = true;
  --frames_left_;
  consume(frame_bytes_);
  return Step::Again;
}

bool Meas28Decoder::accept_number(std::uint32_t word, std::uint32_t& number) noexcept {
  if (word > kCounterMask) return false;
  if (frames_left_ != block_.frames) return word == (next_counter_ & kCounterMask);
  // The header counts too. Both counts may start at different numbers, but their difference stays: that tells
  // a damaged count from a jump.
  const std::uint32_t offset = (word - block_.counter) & kCounterMask;
  if (offset_confirmed_ && offset != offset_) {
    const bool again = rival_known_ && offset == rival_offset_;
    rival_offset_ = offset;
    rival_known_ = true;
    if (!again) return false;
  }
  offset_confirmed_ = offset_known_ && offset == offset_;
  offset_ = offset;
  offset_known_ = true;
  rival_known_ = false;
  number = unwrap(word, kCounterMask);
  return true;
}

std::uint32_t Meas28Decoder::unwrap(std::uint32_t number, std::uint32_t mask) noexcept {
  if (!numbering_) return number;
  const std::uint32_t ahead = (number - next_counter_) & mask;
  if (ahead > kLongestGap) {
    ++counters_.restarts;
    return number;
  }
  counters_.lost_readings += ahead;
  return next_counter_ + ahead;
}

std::size_t encode_meas28(const Meas28Layout& layout, std::span<const LaserReading> readings,
                          std::uint32_t order_number, std::uint32_t serial_number,
                          std::span<std::byte> out) noexcept {
  const std::size_t size = kHeaderBytes + readings.size() * layout.frame_bytes();
  if (readings.empty() || readings.size() > std::numeric_limits<std::uint16_t>::max() || size > out.size())
    return 0;
  std::byte* p = write_u32(out.data(), kPreamble);
  p = write_u32(p, order_number);
  p = write_u32(p, serial_number);
  p = write_u32(p, flags_of(layout));
  p = write_u32(p, 0);
  p = write_u16(p, static_cast<std::uint16_t>(readings.size()));
  p = write_u16(p, static_cast<std::uint16_t>(layout.frame_bytes()));
  p = write_u32(p, readings.front().counter);
  for (const LaserReading& reading : readings) {
    if (layout.exposure) p = write_u32(p, 0);
    if (layout.counter) p = write_u32(p, reading.counter & kCounterMask);
    if (layout.timestamp) p = write_u32(p, reading.timestamp_us);
    if (layout.intensity) p = write_u32(p, 0);
    p = write_u32(p, distance_word(reading));
    if (layout.status) p = write_u32(p, 0);
  }
  return size;
}

}  // namespace weldcell::wire
