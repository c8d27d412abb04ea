#include "weldcell/wire/laser.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <vector>

#include "unit/wire/egm_golden.hpp"

namespace weldcell::wire {
namespace {

using Stream = std::vector<std::byte>;

// Two frames of counter, timestamp, distance. clang-format off
constexpr const char* kGoldenBlock =
    "5341454d"  // preamble, "SAEM" on the wire
    "15cd5b07"  // order number 123456789
    "b168de3a"  // serial number 987654321
    "18000000"  // flags 1: counter, timestamp
    "00000000"  // flags 2
    "0200"      // frames
    "0c00"      // bytes a frame
    "feffff00"  // counter of the first frame 0x00FFFFFE
    "feffff00"
    "40e20100"
    "40e2e60b"  // 16777214, 123456 us, 199.680576 mm
    "ffffff00"
    "08e30100"
    "fbffff7f";  // 16777215, 123656 us, no peak
// clang-format on

std::vector<LaserReading> decode(const Stream& stream, const Meas28Layout& layout = {},
                                 LaserCounters* counters = nullptr) {
  Meas28Decoder decoder(layout);
  std::vector<LaserReading> out;
  decoder.feed(stream, [&](const LaserReading& reading) { out.push_back(reading); });
  if (counters) *counters = decoder.counters();
  return out;
}

bool same(const LaserReading& a, const LaserReading& b) {
  // Above 24 bits the number depends on where the count was first seen.
  return ((a.counter ^ b.counter) & 0xFFFFFF) == 0 && a.timestamp_us == b.timestamp_us && a.code == b.code &&
         (a.code != 0 || a.distance_mm == b.distance_mm);
}

/// Readings 200 us apart from a number on, with an error code now and then.
std::vector<LaserReading> readings(std::uint32_t from, std::size_t count) {
  std::vector<LaserReading> out(count);
  for (std::size_t i = 0; i < count; ++i) {
    out[i].counter = from + static_cast<std::uint32_t>(i);
    out[i].timestamp_us = out[i].counter * 200;
    if (out[i].counter % 7 == 3) {
      out[i].code = 0x7FFFFFFB;
    } else {
      out[i].distance_mm = 100.0F + static_cast<float>(i);
    }
  }
  return out;
}

Stream block(const std::vector<LaserReading>& values, const Meas28Layout& layout = {}) {
  Stream out(28 + values.size() * layout.frame_bytes());
  EXPECT_EQ(encode_meas28(layout, values, 2300, 17, out), out.size());
  return out;
}

void append(Stream& to, const Stream& more) { to.insert(to.end(), more.begin(), more.end()); }

TEST(Meas28, GoldenBlock) {
  LaserCounters counters;
  const auto got = decode(golden::bytes(kGoldenBlock), {}, &counters);
  ASSERT_EQ(got.size(), 2U);
  EXPECT_EQ(got[0].counter, 0xFFFFFEU);
  EXPECT_EQ(got[0].timestamp_us, 123456U);
  EXPECT_EQ(got[0].code, 0U);
  EXPECT_FLOAT_EQ(got[0].distance_mm, 199.680576F);
  EXPECT_EQ(got[1].code, 0x7FFFFFFBU);
  EXPECT_STREQ(laser_code_text(got[1].code), "no peak");
  EXPECT_EQ(counters.blocks, 1U);
  EXPECT_EQ(counters.readings, 2U);
  EXPECT_EQ(counters.lost_readings + counters.resyncs + counters.skipped_bytes + counters.restarts, 0U);
}

TEST(Meas28, EncoderWritesTheGoldenBlock) {
  std::vector<LaserReading> values(2);
  values[0] = {199.680576F, 0, 0xFFFFFE, 123456};
  values[1] = {0, 0x7FFFFFFB, 0xFFFFFF, 123656};
  Stream out(52);
  ASSERT_EQ(encode_meas28({}, values, 123456789, 987654321, out), 52U);
  // A float carries the distance to 15 nm there, so its lowest byte may differ.
  Stream expected = golden::bytes(kGoldenBlock);
  out[36] = expected[36];
  EXPECT_EQ(out, expected);
  EXPECT_EQ(encode_meas28({}, values, 1, 2, std::span(out).first(51)), 0U);
  EXPECT_EQ(encode_meas28({}, {}, 1, 2, out), 0U);
}

TEST(Meas28, EveryItemInTheSensorsOrder) {
  const Meas28Layout layout{true, true, true, true, true};
  ASSERT_EQ(layout.frame_bytes(), 24U);
  Stream stream = golden::bytes(
      "5341454d000000000000000000000000000000000100180009000000"
      "11111100"
      "09000000"
      "22222200"
      "33333300"
      "40420f00"
      "44444400");
  const auto got = decode(stream, layout);
  ASSERT_EQ(got.size(), 1U);
  EXPECT_EQ(got[0].counter, 9U);
  EXPECT_EQ(got[0].timestamp_us, 0x222222U);
  EXPECT_FLOAT_EQ(got[0].distance_mm, 1.0F);
}

TEST(Meas28, DistanceOnly) {
  const Meas28Layout layout{false, false, false, false, false};
  Stream stream = block(readings(40, 3), layout);
  append(stream, block(readings(45, 2), layout));
  LaserCounters counters;
  const auto got = decode(stream, layout, &counters);
  ASSERT_EQ(got.size(), 5U);
  EXPECT_EQ(got[2].counter, 42U);
  EXPECT_EQ(got[3].counter, 45U);
  EXPECT_EQ(counters.lost_readings, 2U);
}

TEST(Meas28, NegativeDistanceIsBeforeTheRangeNotAnError) {
  std::vector<LaserReading> one(1);
  one[0].distance_mm = -1.5F;
  const auto got = decode(block(one));
  ASSERT_EQ(got.size(), 1U);
  EXPECT_EQ(got[0].code, 0U);
  EXPECT_FLOAT_EQ(got[0].distance_mm, -1.5F);
}

TEST(Meas28, EveryErrorCodeIsKept) {
  for (std::uint32_t code = 0x7FFFFFF5; code <= 0x7FFFFFFB; ++code) {
    std::vector<LaserReading> one(1);
    one[0].code = code;
    const auto got = decode(block(one));
    ASSERT_EQ(got.size(), 1U);
    EXPECT_EQ(got[0].code, code);
    EXPECT_STRNE(laser_code_text(code), "unknown");
  }
  std::vector<LaserReading> last(1);
  last[0].distance_mm = 2147.483391F;
  EXPECT_EQ(decode(block(last))[0].code, 0U);
}

TEST(Meas28, EitherOrderOfTheTwoSizesIsAcceptedAndThenKept) {
  const auto swapped = [](Stream b) {
    std::swap_ranges(b.begin() + 20, b.begin() + 22, b.begin() + 22);
    return b;
  };
  const Stream first = block(readings(0, 5)), second = block(readings(5, 5));
  for (const bool swap_first : {false, true}) {
    Stream stream = swap_first ? swapped(first) : first;
    append(stream, swap_first ? swapped(second) : second);
    append(stream, swap_first ? second : swapped(second));
    LaserCounters counters;
    EXPECT_EQ(decode(stream, {}, &counters).size(), 10U);
    EXPECT_EQ(counters.resyncs, 1U);
  }
  // Twelve frames of twelve bytes decide nothing; the next block does.
  Stream stream = block(readings(0, 12));
  append(stream, swapped(block(readings(12, 5))));
  EXPECT_EQ(decode(stream).size(), 17U);
}

TEST(Meas28, BlockOfAnotherFrameSizeIsRefused) {
  Stream stream = block(readings(0, 5), Meas28Layout{false, true, true, true, false});
  append(stream, block(readings(5, 5)));
  LaserCounters counters;
  const auto got = decode(stream, {}, &counters);
  ASSERT_EQ(got.size(), 5U);
  EXPECT_EQ(got[0].counter, 5U);
  EXPECT_EQ(counters.resyncs, 1U);
}

TEST(Meas28, EverySplitGivesTheSameReadings) {
  Stream stream;
  for (std::uint32_t k = 0; k < 4; ++k) append(stream, block(readings(1000 + 5 * k, 5)));
  const auto whole = decode(stream);
  ASSERT_EQ(whole.size(), 20U);
  const auto expect_same = [&](const std::vector<LaserReading>& got, std::size_t a, std::size_t b) {
    ASSERT_EQ(got.size(), whole.size()) << "split at " << a << ", " << b;
    for (std::size_t i = 0; i < got.size(); ++i)
      EXPECT_TRUE(same(got[i], whole[i])) << "split at " << a << ", " << b;
  };
  for (std::size_t a = 0; a <= stream.size(); ++a) {
    for (std::size_t b = a; b <= stream.size(); b += 7) {
      Meas28Decoder decoder{Meas28Layout{}};
      std::vector<LaserReading> got;
      const auto sink = [&](const LaserReading& r) { got.push_back(r); };
      decoder.feed(std::span(stream).first(a), sink);
      decoder.feed(std::span(stream).subspan(a, b - a), sink);
      decoder.feed(std::span(stream).subspan(b), sink);
      expect_same(got, a, b);
    }
  }
  for (std::size_t piece = 1; piece < 40; ++piece) {
    Meas28Decoder decoder{Meas28Layout{}};
    std::vector<LaserReading> got;
    for (std::size_t at = 0; at < stream.size(); at += piece) {
      decoder.feed(std::span(stream).subspan(at, std::min(piece, stream.size() - at)),
                   [&](const LaserReading& r) { got.push_back(r); });
    }
    expect_same(got, piece, piece);
  }
}

TEST(Meas28, BlocksLongerThanTheBuffer) {
  Stream stream = block(readings(0, 5000));
  append(stream, block(readings(5000, 1)));
  LaserCounters counters;
  EXPECT_EQ(decode(stream, {}, &counters).size(), 5001U);
  EXPECT_EQ(counters.lost_readings + counters.resyncs, 0U);
}

/// Every kind of damage at every byte of every block: no reading of another block may be lost or changed.
TEST(Meas28, DamageLosesOnlyTheDamagedBlock) {
  constexpr std::size_t kBlocks = 4, kFrames = 5, kBlockBytes = 28 + kFrames * 12;
  Stream good;
  for (std::uint32_t k = 0; k < kBlocks; ++k) append(good, block(readings(70000 + kFrames * k, kFrames)));
  const auto whole = decode(good);
  std::size_t cases = 0, detected = 0;
  for (std::size_t at = 0; at < good.size(); ++at) {
    const std::size_t damaged = at / kBlockBytes, room = (damaged + 1) * kBlockBytes - at;
    for (int kind = 0; kind < 7; ++kind) {
      Stream stream = good;
      const auto place = stream.begin() + static_cast<std::ptrdiff_t>(at);
      const std::size_t cut = kind == 3 ? 1 : kind == 4 ? 4 : kind == 5 ? 17 : 0;
      if (kind == 0) stream[at] ^= std::byte{0xFF};
      if (kind == 1) stream[at] ^= std::byte{0x01};
      if (kind == 2) stream[at] ^= std::byte{0x80};
      if (cut > 0) stream.erase(place, place + static_cast<std::ptrdiff_t>(std::min(cut, room)));
      if (kind == 6) stream.insert(place, 5, std::byte{0x5A});
      LaserCounters counters;
      const auto got = decode(stream, {}, &counters);
      for (std::size_t i = 0; i < whole.size(); ++i) {
        if (i / kFrames == damaged) continue;
        const bool there =
            std::any_of(got.begin(), got.end(), [&](const auto& r) { return same(r, whole[i]); });
        ASSERT_TRUE(there) << "byte " << at << " kind " << kind << ": reading " << i
                           << " of another block is lost";
      }
      ++cases;
      detected += counters.resyncs > 0 ? 1 : 0;
    }
  }
  EXPECT_EQ(cases, good.size() * 7);
  EXPECT_GT(detected, cases / 2);  // the rest are flips in values, which the format cannot show
}

TEST(Meas28, NoiseBetweenBlocksIsSkippedAndCounted) {
  std::mt19937 random(20240711);
  RecordProperty("seed", 20240711);
  for (int round = 0; round < 200; ++round) {
    Stream stream;
    std::size_t noise = 0;
    for (std::uint32_t k = 0; k < 5; ++k) {
      const std::size_t n = random() % 60;
      for (std::size_t i = 0; i < n; ++i) stream.push_back(static_cast<std::byte>(random() & 0xFF));
      noise += n;
      append(stream, block(readings(5 * k, 5)));
    }
    LaserCounters counters;
    const auto got = decode(stream, {}, &counters);
    ASSERT_EQ(got.size(), 25U) << "seed 20240711, round " << round;
    EXPECT_GE(counters.skipped_bytes, noise);
  }
}

TEST(Meas28, LossesRestartsAndWraps) {
  Meas28Decoder decoder{Meas28Layout{}};
  std::vector<LaserReading> got;
  const auto feed = [&](std::uint32_t from, std::size_t count) {
    decoder.feed(block(readings(from, count)), [&](const LaserReading& r) { got.push_back(r); });
  };
  feed(0xFFFFFA, 4);
  feed(0x1000000 + 3, 4);  // 24-bit wrap with 5 lost
  EXPECT_EQ(decoder.counters().lost_readings, 5U);
  EXPECT_EQ(got.back().counter, 0x1000006U);
  feed(0x1000007, 1);
  EXPECT_EQ(decoder.counters().lost_readings, 5U);
  feed(0xC00000, 1);  // the sensor was restarted, and restarted again
  EXPECT_EQ(decoder.counters().restarts, 1U);
  feed(10, 2);
  EXPECT_EQ(decoder.counters().restarts, 2U);
  EXPECT_EQ(got.back().counter, 11U);
  EXPECT_EQ(decoder.counters().lost_readings, 5U);
  decoder.reset();
  feed(500, 1);
  EXPECT_EQ(got.back().counter, 500U);
  EXPECT_EQ(decoder.counters().restarts, 2U);
  EXPECT_EQ(decoder.counters().lost_readings, 5U);
}

TEST(Meas28, FrameCountMayDifferFromHeaderCountByAConstant) {
  const auto shifted = [](std::uint32_t from, std::uint32_t header) {
    Stream b = block(readings(from, 3));
    for (std::size_t i = 0; i < 4; ++i) b[24 + i] = static_cast<std::byte>(header >> (8 * i) & 0xFF);
    return b;
  };
  Stream stream;
  for (std::uint32_t k = 0; k < 4; ++k) append(stream, shifted(100 + 3 * k, 9000 + 3 * k));
  append(stream, shifted(112, 55));  // damaged header count: dropped
  append(stream, shifted(115, 9015));
  LaserCounters counters;
  const auto got = decode(stream, {}, &counters);
  EXPECT_EQ(got.size(), 15U);
  EXPECT_EQ(got.back().counter, 117U);
  EXPECT_EQ(counters.lost_readings, 3U);
  EXPECT_EQ(counters.restarts, 0U);
}

}  // namespace
}  // namespace weldcell::wire
