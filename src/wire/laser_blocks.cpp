// Data28 and Meas32: blocks of a header and frames of 32-bit words.
#include <cmath>

#include "weldcell/wire/laser_dialects.hpp"

namespace weldcell::wire {
namespace {

constexpr std::uint32_t kData = 0x41544144;  // "DATA" on the wire
constexpr std::uint32_t kMeas = 0x4D454153;  // "SAEM" on the wire
constexpr double kMmPerCount = 1e-6;
constexpr std::uint32_t kLongestGap = 1U << 20;
constexpr std::uint32_t kMostFrames = 65535;

std::uint32_t at(const std::byte* p, int i) { return static_cast<std::uint32_t>(p[i]); }
std::uint32_t little(const std::byte* p) {
  return at(p, 0) | at(p, 1) << 8 | at(p, 2) << 16 | at(p, 3) << 24;
}

std::size_t header_size(LaserDialect dialect) { return dialect == LaserDialect::Data28 ? 28 : 32; }

}  // namespace

LaserBlockDecoder::LaserBlockDecoder(const LaserFormat& format)
    : format_(format), header_bytes_(header_size(format.dialect)), frame_bytes_(4 * format.words) {}

void LaserBlockDecoder::reset() {
  const LaserCounters kept = counters_;
  *this = LaserBlockDecoder(format_);
  counters_ = kept;
}

bool LaserBlockDecoder::may_be_header(const std::byte* p) const noexcept {
  return little(p) == (format_.dialect == LaserDialect::Data28 ? kData : kMeas);
}

bool LaserBlockDecoder::read_header(const std::byte* p, Header& out) const noexcept {
  if (!may_be_header(p)) return false;
  if (format_.dialect == LaserDialect::Data28) {
    // Whether the length is a frame's or the block's is not settled: either must agree.
    const std::uint32_t video = little(p + 12), length = little(p + 16);
    out.frames = little(p + 20);
    out.counter = little(p + 24);
    return video == 0 && out.frames <= kMostFrames &&
           (length == frame_bytes_ || length == out.frames * frame_bytes_);
  }
  out.frames = at(p, 24) | at(p, 25) << 8;
  out.counter = little(p + 28);
  return (at(p, 26) | at(p, 27) << 8) == frame_bytes_;
}

bool LaserBlockDecoder::header_here() const noexcept {
  Header header;
  return read_header(front(), header);
}

auto LaserBlockDecoder::take_header() noexcept -> Step {
  if (size() < header_bytes_) return Step::NeedMore;
  if (!read_header(front(), block_)) {
    lose_sync();
    return Step::Again;
  }
  consume(header_bytes_);
  frames_left_ = block_.frames;
  dropping_ = block_.frames > 0 && !accept_count();
  if (dropping_) {
    ++counters_.resyncs;
  } else {
    ++counters_.blocks;
  }
  after_search_ = false;
  return Step::Again;
}

bool LaserBlockDecoder::accept_count() noexcept {
  const std::uint32_t counter = block_.counter, ahead = counter - next_counter_;
  const std::uint64_t passed = counter - trusted_counter_, room = place() - trusted_place_;
  // No more readings can have gone by than the bytes since the last trusted header had room for; where no
  // byte is missing, whole headers are what remains beside the frames.
  const bool fits = passed <= room / frame_bytes_ + 1;
  const bool exact = passed * frame_bytes_ < room && (room - passed * frame_bytes_) % header_bytes_ == 0;
  const bool goes_on = ahead == 0 && !after_search_;
  const bool rival = rival_known_ && counter == rival_next_;
  if (settled_ && !goes_on && !rival && !exact && !(fits && (after_search_ || doubted_))) {
    rival_next_ = counter + block_.frames;
    rival_known_ = true;
    next_counter_ += block_.frames;
    counters_.lost_readings += block_.frames;
    return false;
  }
  if (settled_ && ahead <= kLongestGap) {
    counters_.lost_readings += ahead;
  } else if (settled_ && rival && !fits) {
    ++counters_.restarts;
  }
  // After a jump the old count stays a rival: two damaged headers may have agreed by chance.
  rival_known_ = rival && !goes_on;
  rival_next_ = next_counter_ + block_.frames;
  doubted_ = !goes_on && !rival;
  if (goes_on || !settled_) {
    trusted_counter_ = counter;
    trusted_place_ = place();
  }
  settled_ = settled_ || (numbering_ && goes_on);
  numbering_ = true;
  next_counter_ = counter;
  return true;
}

auto LaserBlockDecoder::look_for_header() noexcept -> Step {
  // A header inside a block: the block was cut short, or its frame count is damaged. A preamble may begin in
  // the frame before.
  const std::ptrdiff_t from = frames_left_ < block_.frames ? -3 : 0;
  const std::ptrdiff_t last = static_cast<std::ptrdiff_t>(frame_bytes_) - 4;
  for (std::ptrdiff_t i = from; i <= last; ++i) {
    if (!may_be_header(front() + i)) continue;
    if (static_cast<std::ptrdiff_t>(size()) - i < static_cast<std::ptrdiff_t>(header_bytes_))
      return Step::NeedMore;
    if (Header header; read_header(front() + i, header)) {
      // Its missing frames show in the count.
      ++counters_.resyncs;
      counters_.skipped_bytes += i > 0 ? static_cast<std::uint64_t>(i) : 0;
      leave(i);
      frames_left_ = 0;
      after_search_ = true;
      break;
    }
  }
  return Step::Again;
}

auto LaserBlockDecoder::take_frame(LaserReading& out) noexcept -> Step {
  if (size() < frame_bytes_) return Step::NeedMore;
  if (const Step step = look_for_header(); step == Step::NeedMore) return step;
  if (frames_left_ == 0) return Step::Again;
  const std::byte* p = front();
  --frames_left_;
  consume(frame_bytes_);
  if (dropping_) {
    counters_.skipped_bytes += frame_bytes_;
    return Step::Again;
  }
  read_frame(p, out);
  ++next_counter_;
  ++counters_.readings;
  return Step::Reading;
}

void LaserBlockDecoder::read_frame(const std::byte* p, LaserReading& out) const noexcept {
  out = LaserReading{};
  out.counter = next_counter_;
  const std::byte* distance = p + 4 * format_.distance_word;
  const std::uint32_t word = little(distance);
  const auto counts = static_cast<std::int32_t>(word);
  if (counts >= static_cast<std::int32_t>(kLaserFirstErrorCode)) out.code = word;
  if (format_.timestamp_word >= 0) out.timestamp_us = little(p + 4 * format_.timestamp_word);
  if (format_.dialect != LaserDialect::Meas32) {
    out.distance_mm = static_cast<float>(counts * kMmPerCount);
    return;
  }
  const double part = (counts - format_.raw_min) / (format_.raw_max - format_.raw_min);
  if (out.code == 0 && part < -0.01) out.code = kLaserBelowScale;
  if (out.code == 0 && part > 1.01) out.code = kLaserAboveScale;
  if (out.code == 0) out.distance_mm = static_cast<float>(part * format_.range_mm + format_.offset_mm);
}

}  // namespace weldcell::wire
