#include "sim/laser_wire.hpp"

#include <algorithm>
#include <cmath>

namespace weldcell::sim {

namespace {

using wire::LaserDialect;

constexpr std::uint32_t kOrderNumber = 4120176, kSerialNumber = 260021;
constexpr std::size_t kPacket = 1400;  // what the sensors put into one packet at most
constexpr double kExposure_ns = 200e3;

class Packet {
 public:
  explicit Packet(bool big_end_first = false) : big_(big_end_first) {}
  Packet& word(std::uint64_t value, int bytes = 4) {
    for (int i = 0; i < bytes; ++i) {
      const int shift = 8 * (big_ ? bytes - 1 - i : i);
      out_.push_back(static_cast<std::byte>(value >> shift & 0xFF));
    }
    return *this;
  }
  Packet& text(const char* letters) {
    for (; *letters != 0; ++letters) out_.push_back(static_cast<std::byte>(*letters));
    return *this;
  }
  std::vector<std::byte> take() { return std::move(out_); }

 private:
  bool big_;
  std::vector<std::byte> out_;
};

std::uint32_t nanometres(double distance_mm) {
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(distance_mm * 1e6)));
}

std::uint32_t pick(const Sample& s, std::uint32_t value, std::uint32_t no_peak, std::uint32_t before,
                   std::uint32_t behind) {
  switch (s.echo) {
    case Echo::Distance:
      return value;
    case Echo::NoPeak:
      return no_peak;
    case Echo::BeforeRange:
      return before;
    case Echo::BehindRange:
      return behind;
  }
  return no_peak;
}

std::uint32_t microseconds(const Sample& s) { return static_cast<std::uint32_t>(s.device_ns / 1000); }
std::uint32_t low(std::uint64_t number) { return static_cast<std::uint32_t>(number); }

}  // namespace

double LaserWire::gather_s() const { return settings_.dialect == LaserDialect::Od5000 ? 0.001 : 0.004; }

std::size_t LaserWire::frame_bytes() const {
  if (settings_.dialect == LaserDialect::TwoByte) return 2;
  if (settings_.dialect == LaserDialect::ThreeByte) return 3;
  if (settings_.dialect != LaserDialect::Meas28) return 4 * settings_.words;
  const wire::Meas28Layout& on = settings_.meas28;
  return 4 * (1U + (on.exposure ? 1U : 0U) + (on.counter ? 1U : 0U) + (on.timestamp ? 1U : 0U) +
              (on.intensity ? 1U : 0U) + (on.status ? 1U : 0U));
}

std::size_t LaserWire::most_samples() const {
  return std::max<std::size_t>(1, (kPacket - 32) / frame_bytes());
}

std::vector<std::byte> LaserWire::encode(std::span<const Sample> samples) const {
  switch (settings_.dialect) {
    case LaserDialect::Meas28:
      return meas28(samples);
    case LaserDialect::Data28:
      return data28(samples);
    case LaserDialect::Meas32:
      return meas32(samples);
    case LaserDialect::TwoByte:
    case LaserDialect::ThreeByte:
      return bytes(samples);
    case LaserDialect::Od5000:
      return od5000(samples);
  }
  return {};
}

std::vector<std::byte> LaserWire::meas28(std::span<const Sample> samples) const {
  // optoNCDT 2300: "MEAS" as a little-endian word, order, serial, two words of flags, frames, bytes a frame,
  // count of the first value.
  const wire::Meas28Layout& on = settings_.meas28;
  const std::uint32_t flags = (on.exposure ? 1U << 2 : 0U) | (on.counter ? 1U << 3 : 0U) |
                              (on.timestamp ? 1U << 4 : 0U) | (on.intensity ? 1U << 8 : 0U) |
                              (on.status ? 1U << 16 : 0U);
  Packet p;
  p.text("SAEM").word(kOrderNumber).word(kSerialNumber).word(flags).word(0);
  p.word(samples.size(), 2).word(frame_bytes(), 2).word(low(samples.front().number));
  for (const Sample& s : samples) {
    if (on.exposure) p.word(static_cast<std::uint32_t>(kExposure_ns / 12.5));
    if (on.counter) p.word(s.number & 0xFFFFFF);
    if (on.timestamp) p.word(microseconds(s));
    if (on.intensity) p.word(s.echo == Echo::Distance ? 0x00800200 : 0);
    p.word(pick(s, nanometres(s.distance_mm), 0x7FFFFFFB, 0x7FFFFFFA, 0x7FFFFFF9));
    if (on.status) p.word(pick(s, 0, 1U << 2, 1U << 5, 1U << 6));
  }
  return p.take();
}

std::vector<std::byte> LaserWire::data28(std::span<const Sample> samples) const {
  // IFC242x: "DATA", order, serial, bytes of video, bytes of a frame, frames, count.
  Packet p;
  p.text("DATA").word(kOrderNumber).word(kSerialNumber).word(0).word(frame_bytes());
  p.word(samples.size()).word(low(samples.front().number));
  for (const Sample& s : samples) {
    for (std::size_t i = 0; i < settings_.words; ++i) {
      if (i == settings_.distance_word) {
        p.word(pick(s, nanometres(s.distance_mm), 0x7FFFFF04, 0x7FFFFF05, 0x7FFFFF06));
      } else if (static_cast<int>(i) == settings_.timestamp_word) {
        p.word(microseconds(s));
      } else {
        p.word(s.echo == Echo::Distance ? 0x200 : 0);
      }
    }
  }
  return p.take();
}

std::vector<std::byte> LaserWire::meas32(std::span<const Sample> samples) const {
  // IF1032: two bits a channel say which are there; a sensor behind a 4..20 mA loop, whose error current is
  // 3.75 mA: a 64th of the span below its beginning.
  std::uint64_t channels = 0;
  for (std::size_t i = 0; i < settings_.words; ++i) channels |= std::uint64_t{1} << 2 * i;
  Packet p;
  p.text("SAEM").word(kOrderNumber).word(kSerialNumber).word(channels, 8).word(0);
  p.word(samples.size(), 2).word(frame_bytes(), 2).word(low(samples.front().number));
  const double span = settings_.raw_max - settings_.raw_min;
  for (const Sample& s : samples) {
    const double part = s.echo == Echo::Distance ? s.distance_mm / settings_.range_mm : -1.0 / 64;
    const auto raw = static_cast<std::int32_t>(std::lround(settings_.raw_min + part * span));
    for (std::size_t i = 0; i < settings_.words; ++i) {
      p.word(i == settings_.distance_word ? static_cast<std::uint32_t>(raw) : 0x1234);
    }
  }
  return p.take();
}

std::vector<std::byte> LaserWire::bytes(std::span<const Sample> samples) const {
  // optoNCDT 1402: 14 bits in two bytes, the high one marked; 1220 to 1420: 18 bits in three, low one first.
  const bool two = settings_.dialect == LaserDialect::TwoByte;
  const double scale = two ? 16368 : 65520;
  Packet p;
  for (const Sample& s : samples) {
    const double part = std::clamp(s.distance_mm / settings_.range_mm, 0.0, 1.0);
    const auto value = static_cast<std::uint32_t>(std::lround((part + 0.01) * scale / 1.02));
    if (two) {
      const std::uint32_t raw = pick(s, value, 16370, 16372, 16374);
      p.word(0x80 | raw >> 7, 1).word(raw & 0x7F, 1);
    } else {
      const std::uint32_t raw = pick(s, value, 262076, 262077, 262078);
      p.word(raw & 0x3F, 1).word(0x40 | (raw >> 6 & 0x3F), 1).word(0x80 | raw >> 12, 1);
    }
  }
  return p.take();
}

std::vector<std::byte> LaserWire::od5000(std::span<const Sample> samples) const {
  // OD5000 push, big end first: 0xD and the bytes that follow, status, ns within the second and count of the
  // first value, then the channels' values in nm.
  Packet p(true);
  p.word(0xD000 | (12 + samples.size() * frame_bytes()), 2).word(0x40000401);
  p.word(samples.front().device_ns % 1'000'000'000).word(low(samples.front().number));
  for (const Sample& s : samples) {
    for (std::size_t i = 0; i < settings_.words; ++i) {
      const bool measured = i == settings_.distance_word && s.echo == Echo::Distance;
      p.word(measured ? nanometres(s.distance_mm) : 0x7FFFFFFF);
    }
  }
  return p.take();
}

}  // namespace weldcell::sim
