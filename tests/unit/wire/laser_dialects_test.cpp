#include "weldcell/wire/laser_dialects.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "unit/wire/egm_golden.hpp"
#include "unit/wire/laser_damage.hpp"
#include "unit/wire/laser_streams.hpp"

namespace weldcell::wire {
namespace {

using streams::blocks, streams::feed_blocks, streams::format_of, streams::put_block, streams::Stream;
using Readings = std::vector<LaserReading>;

constexpr std::size_t kDatagram = 14 + 5 * 8;  ///< of blocks() for an OD5000: five readings of two channels

// clang-format off
constexpr const char* kData28 =
    "44415441" "15cd5b07" "b168de3a"  // "DATA", order number, serial number
    "00000000" "0c000000" "02000000"  // no video, 12 bytes a frame, 2 frames
    "feffffff"                        // counter of the first frame 2^32 - 2
    "00020000" "40420f00" "40e20100"  // intensity 0.5, 1.000000 mm, 123456 us
    "00000000" "04ffff7f" "a4e20100";  // no peak, 123556 us
constexpr const char* kMeas32 =
    "5341454d" "15cd5b07" "b168de3a"            // preamble, order number, serial number
    "0500000000000000" "00000000"              // channels 1 and 2 there, status
    "0300" "0800" "07000000"                   // 3 frames of 8 bytes, counter 7
    "11110000" "ed3d0000"                      // channel 2: 15853
    "11110000" "bd0c0000"                      // 3261
    "11110000" "00000000";                     // 0: beyond the end of the inverted scale
constexpr const char* kTwoByte =
    "8121"   // 161: start of the range
    "fe4f"   // 16207: its end
    "ff72";  // 16370: no object
constexpr const char* kThreeByte =
    "034a80"   // 643: start of the range
    "2d758f"   // 64877: its end
    "0c7fbf";  // 262092: above every code known, kept all the same
constexpr const char* kOd5000 =
    "d01c" "40000401" "1db7ea6e" "003a24fe"  // 28 bytes follow, status, 498592366 ns, counter 3810558
    "00e8e450" "7fffffff"                    // channel A 15.262800 mm, channel B none
    "00e8e451" "00000001";                   // 15.262801 mm, 0.000001 mm
// clang-format on

Readings decode(const LaserFormat& format, const Stream& stream, LaserCounters* counters = nullptr) {
  LaserDecoder decoder(format);
  Readings out;
  feed_blocks(decoder, format.dialect, stream, kDatagram, [&](const LaserReading& r) { out.push_back(r); });
  if (counters) *counters = decoder.counters();
  return out;
}

bool same(const LaserReading& a, const LaserReading& b) {
  return a.counter == b.counter && a.timestamp_us == b.timestamp_us && a.code == b.code &&
         a.distance_mm == b.distance_mm;
}

bool is_stream(LaserDialect d) { return d != LaserDialect::Od5000; }

class EachDialect : public testing::TestWithParam<LaserDialect> {};
INSTANTIATE_TEST_SUITE_P(Lasers, EachDialect,
                         testing::Values(LaserDialect::Data28, LaserDialect::Meas32, LaserDialect::TwoByte,
                                         LaserDialect::ThreeByte, LaserDialect::Od5000));
/// Dialects whose bytes may be split anywhere; a datagram comes whole or not at all.
class EachStream : public EachDialect {};
INSTANTIATE_TEST_SUITE_P(Lasers, EachStream,
                         testing::Values(LaserDialect::Data28, LaserDialect::Meas32, LaserDialect::TwoByte,
                                         LaserDialect::ThreeByte));
/// Dialects that count their readings.
class EachCounting : public EachDialect {};
INSTANTIATE_TEST_SUITE_P(Lasers, EachCounting,
                         testing::Values(LaserDialect::Data28, LaserDialect::Meas32, LaserDialect::Od5000));

TEST(LaserDialects, Data28Golden) {
  const auto r = decode(format_of(LaserDialect::Data28), golden::bytes(kData28));
  ASSERT_EQ(r.size(), 2U);
  EXPECT_TRUE(same(r[0], {1.0F, 0, 0xFFFFFFFE, 123456}));
  EXPECT_EQ(r[1].code, 0x7FFFFF04U);
  EXPECT_STREQ(laser_code_text(r[1].code), "no peak");
  EXPECT_EQ(r[1].counter, 0xFFFFFFFFU);
  EXPECT_EQ(r[1].timestamp_us, 123556U);
}

TEST(LaserDialects, Data28TakesTheBlocksLengthToo) {
  Stream s = golden::bytes(kData28);
  s[16] = std::byte{24};
  EXPECT_EQ(decode(format_of(LaserDialect::Data28), s).size(), 2U);
}

TEST(LaserDialects, Meas32GoldenOnAnInvertedScale) {
  const auto r = decode(format_of(LaserDialect::Meas32), golden::bytes(kMeas32));
  ASSERT_EQ(r.size(), 3U);
  EXPECT_TRUE(same(r[0], {35.0F, 0, 7, 0}));
  EXPECT_TRUE(same(r[1], {85.0F, 0, 8, 0}));
  EXPECT_EQ(r[2].code, kLaserAboveScale);
}

TEST(LaserDialects, TwoByteGolden) {
  const auto r = decode(format_of(LaserDialect::TwoByte), golden::bytes(kTwoByte));
  ASSERT_EQ(r.size(), 3U);
  EXPECT_NEAR(r[0].distance_mm, 0, 0.007);  // a step is 0.0062 mm
  EXPECT_NEAR(r[1].distance_mm, 100, 0.007);
  EXPECT_EQ(r[2].code, 16370U);
  EXPECT_STREQ(laser_code_text(r[2].code), "no peak");
  EXPECT_EQ(r[2].counter, 2U);
}

TEST(LaserDialects, ThreeByteGolden) {
  const auto r = decode(format_of(LaserDialect::ThreeByte), golden::bytes(kThreeByte));
  ASSERT_EQ(r.size(), 3U);
  EXPECT_NEAR(r[0].distance_mm, 0, 0.0016);  // a step is 0.00156 mm
  EXPECT_NEAR(r[1].distance_mm, 100, 0.0016);
  EXPECT_EQ(r[2].code, 262092U);
  EXPECT_STREQ(laser_code_text(262082), "laser is off");
}

TEST(LaserDialects, Od5000Golden) {
  LaserFormat f = format_of(LaserDialect::Od5000);
  auto r = decode(f, golden::bytes(kOd5000));
  ASSERT_EQ(r.size(), 2U);
  EXPECT_TRUE(same(r[0], {15.2628F, 0, 3810558, 498592}));
  EXPECT_TRUE(same(r[1], {15.262801F, 0, 3810559, 498692}));
  f.distance_word = 1;
  r = decode(f, golden::bytes(kOd5000));
  EXPECT_EQ(r[0].code, 0x7FFFFFFFU);
  EXPECT_TRUE(same(r[1], {0.000001F, 0, 3810559, 498692}));
}

TEST_P(EachStream, EverySplitReadsTheSame) {
  const LaserFormat f = format_of(GetParam());
  const Stream s = blocks(GetParam(), 9996, 4);
  const auto whole = decode(f, s);
  ASSERT_EQ(whole.size(), 20U);
  EXPECT_EQ(std::count_if(whole.begin(), whole.end(), [](const auto& r) { return r.code != 0; }), 3);
  for (std::size_t first = 0; first <= s.size(); ++first) {
    for (std::size_t second = first; second <= s.size(); second += 7) {
      LaserDecoder decoder(f);
      Readings out;
      const auto sink = [&](const LaserReading& r) { out.push_back(r); };
      decoder.feed(std::span(s).first(first), sink);
      decoder.feed(std::span(s).subspan(first, second - first), sink);
      decoder.feed(std::span(s).subspan(second), sink);
      ASSERT_TRUE(std::equal(out.begin(), out.end(), whole.begin(), whole.end(), same))
          << first << ' ' << second;
      ASSERT_EQ(decoder.counters().resyncs, 0U);
      ASSERT_EQ(decoder.counters().lost_readings, 0U);
    }
  }
}

TEST_P(EachDialect, DamageLosesNoMoreThanTheDamagedFrames) {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const streams::Damage d = streams::damage(GetParam(), seed);
    EXPECT_GT(d.sound, d.sent / 3);
    EXPECT_EQ(d.sound_lost, 0U) << "of " << d.sound;
    EXPECT_GT(d.resyncs, 0U);
  }
}

TEST(LaserDialects, DamageToMeas28LosesNoMoreThanTheDamagedFrames) {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const streams::Damage d = streams::damage(LaserDialect::Meas28, seed);
    EXPECT_GT(d.sound, d.sent / 3);
    EXPECT_EQ(d.sound_lost, 0U) << "of " << d.sound;
    EXPECT_GT(d.resyncs, 0U);
  }
}

TEST_P(EachStream, BytesMissingAreCountedAndTheStreamIsFoundAgain) {
  const LaserFormat f = format_of(GetParam());
  const Stream s = blocks(GetParam(), 1000, 30);
  const auto clean = decode(f, s);
  for (std::size_t at = 0; at < s.size() / 2; ++at) {
    Stream cut = s;
    cut.erase(cut.begin() + static_cast<std::ptrdiff_t>(at));
    LaserCounters c;
    const auto read = decode(f, cut, &c);
    ASSERT_GE(read.size() + 12, clean.size()) << at;
    ASSERT_TRUE(std::equal(read.end() - 50, read.end(), clean.end() - 50, [&](const auto& a, const auto& b) {
      return a.code == b.code && a.distance_mm == b.distance_mm && (at < 3 || same(a, b));
    })) << at;
    ASSERT_GT(c.resyncs, 0U) << at;
  }
}

TEST_P(EachDialect, ResetForgetsTheStreamAndKeepsTheCounters) {
  LaserDecoder decoder(format_of(GetParam()));
  const Stream s = blocks(GetParam(), 50, 2);
  std::size_t read = 0;
  const auto sink = [&](const LaserReading&) { ++read; };
  const bool stream = is_stream(GetParam());
  if (stream) {
    decoder.feed(std::span(s).first(s.size() - 1), sink);
  } else {
    decoder.feed(std::span(s).first(kDatagram), sink);
  }
  decoder.reset();
  feed_blocks(decoder, GetParam(), s, kDatagram, sink);
  const std::size_t expected = stream ? 19 : 15;
  EXPECT_EQ(read, expected);
  EXPECT_EQ(decoder.counters().readings, expected);
  EXPECT_EQ(decoder.counters().resyncs, 0U);
}

TEST_P(EachCounting, ACountWrapsJumpsAndRestarts) {
  const LaserFormat f = format_of(GetParam());
  LaserCounters c;
  auto read = decode(f, blocks(GetParam(), 0xFFFFFFFF - 11, 4), &c);
  ASSERT_EQ(read.size(), 20U);
  EXPECT_EQ(read.back().counter, 7U);
  EXPECT_EQ(c.lost_readings + c.restarts + c.resyncs, 0U);

  // 100 readings never sent: the block that says so first waits for the next to agree.
  Stream s = blocks(GetParam(), 1000, 3);
  const Stream later = blocks(GetParam(), 1115, 3);
  s.insert(s.end(), later.begin(), later.end());
  // Datagrams that were lost cost nothing more: the stamp agrees with the count.
  read = decode(f, s, &c);
  const bool stream = is_stream(GetParam());
  EXPECT_EQ(read.size(), stream ? 25U : 30U);
  EXPECT_EQ(read.back().counter, 1129U);
  EXPECT_EQ(c.lost_readings, stream ? 105U : 100U);

  s = blocks(GetParam(), 5000, 3);
  const Stream anew = blocks(GetParam(), 0, 6);
  s.insert(s.end(), anew.begin(), anew.end());
  read = decode(f, s, &c);
  EXPECT_EQ(c.restarts, 1U);
  EXPECT_GE(read.size(), 35U);
  EXPECT_EQ(read.back().counter, 29U);
}

TEST(LaserDialects, Od5000StampsGoOnOverTheSecond) {
  const LaserFormat f = format_of(LaserDialect::Od5000);
  Stream s = blocks(LaserDialect::Od5000, 9990, 4);
  auto r = decode(f, s);
  for (std::size_t i = 1; i < r.size(); ++i) EXPECT_EQ(r[i].timestamp_us - r[i - 1].timestamp_us, 100U);
  // 2.5 s without packets: the count tells the whole seconds.
  put_block(s, LaserDialect::Od5000, 10010 + 25000, 5);
  put_block(s, LaserDialect::Od5000, 10010 + 25005, 5);
  r = decode(f, s);
  ASSERT_EQ(r.size(), 25U);
  EXPECT_EQ(r.back().timestamp_us - r.front().timestamp_us, (35019U - 9990U) * 100);
}

TEST(LaserDialects, DatagramsOvertakenTwiceOrNotTheSensorsAreLeftOut) {
  const LaserFormat f = format_of(LaserDialect::Od5000);
  const Stream s = blocks(LaserDialect::Od5000, 1000, 6);
  const auto datagram = [&](std::size_t i) { return std::span(s).subspan(i * kDatagram, kDatagram); };
  LaserDecoder decoder(f);
  Readings read;
  const auto sink = [&](const LaserReading& r) { read.push_back(r); };
  for (const std::size_t i : {0U, 1U, 3U, 2U, 3U, 4U}) decoder.feed(datagram(i), sink);
  EXPECT_EQ(read.size(), 20U);
  EXPECT_EQ(decoder.counters().lost_readings, 5U);
  EXPECT_EQ(decoder.counters().resyncs, 2U);
  EXPECT_EQ(decoder.counters().restarts, 0U);
  decoder.feed({}, sink);
  decoder.feed(datagram(5).first(kDatagram - 1), sink);
  decoder.feed(std::span(s).subspan(4 * kDatagram), sink);
  EXPECT_EQ(read.size(), 20U);
  decoder.feed(datagram(5), sink);
  EXPECT_EQ(read.size(), 25U);
  for (std::size_t i = 1; i < read.size(); ++i) EXPECT_GT(read[i].timestamp_us, read[i - 1].timestamp_us);
}

TEST(LaserDialects, AFormatThatCannotBeDecodedIsRefused) {
  for (const auto d : {LaserDialect::Data28, LaserDialect::Meas32, LaserDialect::TwoByte,
                       LaserDialect::ThreeByte, LaserDialect::Od5000, LaserDialect::Meas28}) {
    LaserFormat f = format_of(d);
    EXPECT_EQ(laser_format_fault(f), nullptr);
    if (d == LaserDialect::Meas28) continue;
    f.distance_word = f.words;
    EXPECT_NE(laser_format_fault(f), nullptr);
  }
  LaserFormat f = format_of(LaserDialect::TwoByte);
  f.range_mm = 0;
  EXPECT_NE(laser_format_fault(f), nullptr);
  f = format_of(LaserDialect::Meas32);
  f.raw_max = f.raw_min;
  EXPECT_NE(laser_format_fault(f), nullptr);
  f = format_of(LaserDialect::Od5000);
  f.rate_hz = 0;
  EXPECT_NE(laser_format_fault(f), nullptr);
  f = format_of(LaserDialect::Data28);
  f.timestamp_word = 1;
  EXPECT_NE(laser_format_fault(f), nullptr);
}

}  // namespace
}  // namespace weldcell::wire
