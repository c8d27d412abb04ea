// Two and three bytes a reading, what a format must say, and the decoder over all dialects.
#include "weldcell/wire/laser_dialects.hpp"

#include <cmath>

namespace weldcell::wire {
namespace {

constexpr std::size_t kMostWords = 32;
constexpr std::uint32_t kTwoByteScale = 16368, kThreeByteScale = 65520;

bool positive(double value) { return std::isfinite(value) && value > 0; }

std::variant<Meas28Decoder, LaserBlockDecoder, LaserByteDecoder, LaserDatagramDecoder> make(
    const LaserFormat& format) {
  if (format.dialect == LaserDialect::Meas28) return Meas28Decoder(format.meas28);
  if (format.dialect == LaserDialect::TwoByte || format.dialect == LaserDialect::ThreeByte) {
    return LaserByteDecoder(format);
  }
  if (format.dialect == LaserDialect::Od5000) return LaserDatagramDecoder(format);
  return LaserBlockDecoder(format);
}

}  // namespace

const char* to_string(LaserDialect dialect) {
  switch (dialect) {
    case LaserDialect::Meas28:
      return "meas28";
    case LaserDialect::Data28:
      return "data28";
    case LaserDialect::Meas32:
      return "meas32";
    case LaserDialect::TwoByte:
      return "two_byte";
    case LaserDialect::ThreeByte:
      return "three_byte";
    case LaserDialect::Od5000:
      return "od5000";
  }
  return "?";
}

const char* laser_format_fault(const LaserFormat& f) {
  const bool bytes = f.dialect == LaserDialect::TwoByte || f.dialect == LaserDialect::ThreeByte;
  if (f.dialect == LaserDialect::Meas28) return nullptr;
  if ((bytes || f.dialect == LaserDialect::Meas32) && !positive(f.range_mm)) {
    return "the dialect sends parts of the measuring range: give range_mm, above 0";
  }
  if (bytes && f.words != 1)
    return "the dialect carries the distance alone: switch further outputs off, words 1";
  if (f.words < 1 || f.words > kMostWords) return "a frame has 1 to 32 words";
  if (f.distance_word >= f.words) return "distance_word lies beyond the frame: count from 0 up to words - 1";
  if (f.timestamp_word != -1 && (f.dialect != LaserDialect::Data28 || f.timestamp_word < 0 ||
                                 static_cast<std::size_t>(f.timestamp_word) >= f.words ||
                                 static_cast<std::size_t>(f.timestamp_word) == f.distance_word)) {
    return "timestamp_word is a word of a DATA-28 frame beside the distance, or -1";
  }
  if (f.dialect == LaserDialect::Od5000 && !(positive(f.rate_hz) && f.rate_hz >= 1)) {
    return "a packet stamps its first value alone: give rate_hz, at least 1";
  }
  if (f.dialect == LaserDialect::Meas32 &&
      !(std::isfinite(f.raw_min) && std::isfinite(f.raw_max) && std::isfinite(f.offset_mm) &&
        std::abs(f.raw_max - f.raw_min) >= 1)) {
    return "raw_min and raw_max span no scale: take both from the channel's $CHI";
  }
  return nullptr;
}

LaserByteDecoder::LaserByteDecoder(const LaserFormat& format)
    : format_(format), width_(format.dialect == LaserDialect::TwoByte ? 2 : 3) {}

void LaserByteDecoder::reset() {
  const LaserCounters kept = counters_;
  *this = LaserByteDecoder(format_);
  counters_ = kept;
}

void LaserByteDecoder::skip(std::size_t bytes) noexcept {
  if (bytes == 0) return;
  if (run_ == 0) ++counters_.resyncs;
  run_ += bytes;
  counters_.skipped_bytes += bytes;
}

bool LaserByteDecoder::take(std::uint32_t byte, LaserReading& out) noexcept {
  // Two bytes: 1 D13..D7, 0 D6..D0. Three bytes: 00 D5..D0, 01 D11..D6, 1x D17..D12.
  const bool two = width_ == 2;
  const std::size_t place = two ? (byte >> 7 ^ 1U) : byte >> 7 != 0 ? 2 : byte >> 6;
  if (place != held_) {
    skip(held_);
    held_ = 0;
    if (place != 0) {
      skip(1);
      return false;
    }
  }
  if (held_ == 0) raw_ = 0;
  raw_ = two ? raw_ << 7 | (byte & 0x7F) : raw_ | (byte & 0x3F) << (6 * held_);
  if (++held_ < width_) return false;
  held_ = 0;
  if (counters_.readings > 0 && run_ > 0 && next_counter_ > 0) {
    const auto lost = static_cast<std::uint32_t>((run_ + width_ - 1) / width_);
    counters_.lost_readings += lost;
    next_counter_ += lost;
  }
  run_ = 0;
  out = LaserReading{};
  out.counter = next_counter_++;
  const std::uint32_t scale = two ? kTwoByteScale : kThreeByteScale;
  if (raw_ > scale) out.code = raw_;
  if (out.code == 0) out.distance_mm = static_cast<float>((raw_ * 1.02 / scale - 0.01) * format_.range_mm);
  ++counters_.readings;
  return true;
}

LaserDecoder::LaserDecoder(const LaserFormat& format) : decoder_(make(format)) {}

const LaserCounters& LaserDecoder::counters() const {
  return std::visit([](const auto& decoder) -> const LaserCounters& { return decoder.counters(); }, decoder_);
}

void LaserDecoder::reset() {
  std::visit([](auto& decoder) { decoder.reset(); }, decoder_);
}

}  // namespace weldcell::wire
