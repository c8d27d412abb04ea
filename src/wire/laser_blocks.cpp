// Data28, Meas32 and Od5000: blocks of a header and frames of 32-bit words.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "weldcell/wire/laser_dialects.hpp"

namespace weldcell::wire {
namespace {

constexpr std::uint32_t kData = 0x41544144;  // "DATA" on the wire
constexpr std::uint32_t kMeas = 0x4D454153;  // "SAEM" on the wire
constexpr double kMmPerCount = 1e-6;
constexpr std::uint32_t kLongestGap = 1U << 20;
constexpr std::uint32_t kMostFrames = 65535;
constexpr std::uint32_t kOdHead = 12;  ///< header bytes that an OD5000's length counts

std::uint32_t at(const std::byte* p, int i) { return static_cast<std::uint32_t>(p[i]); }
std::uint32_t little(const std::byte* p) {
  return at(p, 0) | at(p, 1) << 8 | at(p, 2) << 16 | at(p, 3) << 24;
}
std::uint32_t big(const std::byte* p) { return at(p, 3) | at(p, 2) << 8 | at(p, 1) << 16 | at(p, 0) << 24; }

std::size_t header_size(LaserDialect dialect) {
  return dialect == LaserDialect::Data28 ? 28 : dialect == LaserDialect::Meas32 ? 32 : 14;
}

}  // namespace

LaserBlockDecoder::LaserBlockDecoder(const LaserFormat& format)
    : format_(format), header_bytes_(header_size(format.dialect)), frame_bytes_(4 * format.words) {}

void LaserBlockDecoder::reset() {
  const LaserCounters kept = counters_;
  *this = LaserBlockDecoder(format_);
  counters_ = kept;
}

std::span<const std::byte> LaserBlockDecoder::take(std::span<const std::byte> bytes) noexcept {
  if (end_ + bytes.size() > buffer_.size()) {
    std::memmove(buffer_.data(), buffer_.data() + last_item_, end_ - last_item_);
    begin_ -= last_item_;
    moved_ += last_item_;
    end_ -= last_item_;
    last_item_ = 0;
  }
  const std::size_t fitting = std::min(bytes.size(), buffer_.size() - end_);
  std::memcpy(buffer_.data() + end_, bytes.data(), fitting);
  end_ += fitting;
  return bytes.subspan(fitting);
}

bool LaserBlockDecoder::next(LaserReading& out) noexcept {
  for (;;) {
    const Step step = searching_ ? search() : frames_left_ == 0 ? take_header() : take_frame(out);
    if (step != Step::Again) return step == Step::Reading;
  }
}

bool LaserBlockDecoder::may_be_header(const std::byte* p) const noexcept {
  if (format_.dialect == LaserDialect::Data28) return little(p) == kData;
  if (format_.dialect == LaserDialect::Meas32) return little(p) == kMeas;
  const std::uint32_t length = (at(p, 0) << 8 | at(p, 1)) & 0xFFF;
  return at(p, 0) >> 4 == 0xD && length > kOdHead && (length - kOdHead) % frame_bytes_ == 0;
}

bool LaserBlockDecoder::parse_header(const std::byte* p, Header& out) const noexcept {
  if (!may_be_header(p)) return false;
  if (format_.dialect == LaserDialect::Data28) {
    // Whether the length is a frame's or the block's is not settled: either must agree.
    const std::uint32_t video = little(p + 12), length = little(p + 16);
    out.frames = little(p + 20);
    out.counter = little(p + 24);
    return video == 0 && out.frames <= kMostFrames &&
           (length == frame_bytes_ || length == out.frames * frame_bytes_);
  }
  if (format_.dialect == LaserDialect::Meas32) {
    out.frames = at(p, 24) | at(p, 25) << 8;
    out.counter = little(p + 28);
    return (at(p, 26) | at(p, 27) << 8) == frame_bytes_;
  }
  const std::uint32_t length = (at(p, 0) << 8 | at(p, 1)) & 0xFFF;
  out.frames = (length - kOdHead) / static_cast<std::uint32_t>(frame_bytes_);
  out.time_ns = big(p + 6);
  out.counter = big(p + 10);
  return out.time_ns < 1'000'000'000;
}

bool LaserBlockDecoder::read_header(const std::byte* p, Header& out) const noexcept {
  if (!parse_header(p, out)) return false;
  // An OD5000's four fixed bits do not make a header: its count must go on.
  return format_.dialect != LaserDialect::Od5000 || !numbering_ ||
         out.counter - next_counter_ <= kLongestGap || (rival_known_ && out.counter == rival_next_);
}

bool LaserBlockDecoder::restarted_here(const std::byte* p) noexcept {
  // A header whose count does not go on is believed when the next one stands at its end and goes on from it.
  Header header;
  if (pair_left_ > 0 && --pair_left_ == 0 && parse_header(p, header) && header.counter == pair_next_) {
    rival_next_ = skip_next_ = header.counter;
    rival_known_ = true;
    return true;
  }
  if (pair_left_ == 0 && parse_header(p, header)) {
    pair_next_ = header.counter + header.frames;
    pair_left_ = header_bytes_ + header.frames * frame_bytes_;
  }
  return false;
}

LaserBlockDecoder::Step LaserBlockDecoder::search() noexcept {
  while (end_ - begin_ >= header_bytes_) {
    const std::byte* p = buffer_.data() + begin_;
    Header header;
    if (read_header(p, header) || (format_.dialect == LaserDialect::Od5000 && restarted_here(p))) {
      searching_ = false;
      after_search_ = true;
      return Step::Again;
    }
    ++begin_;
    ++counters_.skipped_bytes;
    last_item_ = begin_;
  }
  return Step::NeedMore;
}

LaserBlockDecoder::Step LaserBlockDecoder::take_header() noexcept {
  if (end_ - begin_ < header_bytes_) return Step::NeedMore;
  if (!read_header(buffer_.data() + begin_, block_)) {
    lose_sync();
    return Step::Again;
  }
  last_item_ = begin_;
  begin_ += header_bytes_;
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
  const std::uint32_t counter = block_.counter, expected = next_counter_, ahead = counter - expected;
  const std::uint64_t place = moved_ + begin_;
  // No more readings can have gone by than the bytes since the last trusted header had room for.
  const bool fits = (after_search_ || doubted_ || rival_known_) &&
                    counter - trusted_counter_ <= (place - trusted_place_) / frame_bytes_ + 1;
  const bool rival = rival_known_ && (counter == rival_next_ || counter == skip_next_);
  if (numbering_ && ahead != 0 && !fits && !rival) {
    skip_next_ = (rival_known_ ? skip_next_ : expected) + block_.frames;
    rival_next_ = counter + block_.frames;
    rival_known_ = true;
    return false;
  }
  doubted_ = numbering_ && ahead != 0 && !rival;
  if (!doubted_) {
    trusted_counter_ = counter;
    trusted_place_ = place;
  }
  if (numbering_ && ahead > kLongestGap && !fits) {
    ++counters_.restarts;
    timed_ = false;
  } else if (numbering_ && ahead <= kLongestGap) {
    counters_.lost_readings += ahead;
  }
  numbering_ = true;
  rival_known_ = false;
  next_counter_ = counter;
  if (format_.dialect != LaserDialect::Od5000 || place_in_time()) return true;
  next_counter_ += block_.frames;
  counters_.lost_readings += block_.frames;
  return false;
}

bool LaserBlockDecoder::place_in_time() noexcept {
  // The clock starts anew every second; how many seconds have passed is told by the count and the rate.
  const TimeMark now{block_.time_ns, block_.counter};
  double seconds = 0;
  if (timed_ && !follows(mark_, now, seconds)) {
    // A damaged stamp, or a clock set anew: the next header decides.
    double ignored = 0;
    const bool again = time_doubted_ && follows(doubt_, now, ignored);
    doubt_ = now;
    time_doubted_ = true;
    if (!again) return false;
    timed_ = false;
  }
  const std::uint32_t second_us = timed_ ? block_us_ - mark_.time_ns / 1000 : 0;
  block_us_ = second_us + static_cast<std::uint32_t>(static_cast<std::int64_t>(seconds) * 1'000'000) +
              now.time_ns / 1000;
  mark_ = now;
  timed_ = true;
  time_doubted_ = false;
  return true;
}

bool LaserBlockDecoder::follows(const TimeMark& from, const TimeMark& to, double& seconds) const noexcept {
  const double step_us = (static_cast<double>(to.time_ns) - static_cast<double>(from.time_ns)) / 1e3;
  const double counted_us = static_cast<std::int32_t>(to.counter - from.counter) * 1e6 / format_.rate_hz;
  seconds = std::round((counted_us - step_us) / 1e6);
  const double tolerance_us = std::min(2e3 + 0.02 * std::abs(counted_us), 4e5);
  return std::abs(counted_us - step_us - seconds * 1e6) <= tolerance_us;
}

LaserBlockDecoder::Step LaserBlockDecoder::look_for_header() noexcept {
  // A header inside a block: the block was cut short, or its frame count is damaged. A preamble may begin in
  // the frame before; an Od5000's header is too weak to be looked for where no frame starts.
  const bool anywhere = format_.dialect != LaserDialect::Od5000;
  const bool inside = anywhere && frames_left_ < block_.frames;
  const std::size_t from = inside ? begin_ - 3 : begin_;
  const std::size_t last = anywhere ? begin_ + frame_bytes_ - 4 : begin_;
  for (std::size_t i = from; i <= last; ++i) {
    if (!may_be_header(buffer_.data() + i)) continue;
    if (end_ - i < header_bytes_) return Step::NeedMore;
    if (Header header; read_header(buffer_.data() + i, header)) {
      // Its missing frames show in the count.
      ++counters_.resyncs;
      counters_.skipped_bytes += i > begin_ ? i - begin_ : 0;
      begin_ = last_item_ = i;
      frames_left_ = 0;
      after_search_ = true;
      break;
    }
  }
  return Step::Again;
}

LaserBlockDecoder::Step LaserBlockDecoder::take_frame(LaserReading& out) noexcept {
  if (end_ - begin_ < frame_bytes_) return Step::NeedMore;
  if (const Step step = look_for_header(); step == Step::NeedMore) return step;
  if (frames_left_ == 0) return Step::Again;
  const std::byte* p = buffer_.data() + begin_;
  --frames_left_;
  last_item_ = begin_;
  begin_ += frame_bytes_;
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
  const bool od = format_.dialect == LaserDialect::Od5000;
  const std::uint32_t word = od ? big(distance) : little(distance);
  const auto counts = static_cast<std::int32_t>(word);
  if (counts >= static_cast<std::int32_t>(kLaserFirstErrorCode)) out.code = word;
  if (od) {
    out.timestamp_us =
        block_us_ +
        static_cast<std::uint32_t>(std::llround((next_counter_ - block_.counter) * 1e6 / format_.rate_hz));
  } else if (format_.timestamp_word >= 0) {
    out.timestamp_us = little(p + 4 * format_.timestamp_word);
  }
  if (format_.dialect != LaserDialect::Meas32) {
    out.distance_mm = static_cast<float>(counts * kMmPerCount);
    return;
  }
  const double part = (counts - format_.raw_min) / (format_.raw_max - format_.raw_min);
  if (out.code == 0 && part < -0.01) out.code = kLaserBelowScale;
  if (out.code == 0 && part > 1.01) out.code = kLaserAboveScale;
  if (out.code == 0) out.distance_mm = static_cast<float>(part * format_.range_mm + format_.offset_mm);
}

void LaserBlockDecoder::lose_sync() noexcept {
  ++counters_.resyncs;
  frames_left_ = 0;
  searching_ = true;
  pair_left_ = 0;
  // Missing bytes may have made the last item swallow the beginning of the next header.
  if (last_item_ < begin_) begin_ = last_item_ + 1;
  last_item_ = begin_;
}

}  // namespace weldcell::wire
