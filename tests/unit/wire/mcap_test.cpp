#include "weldcell/wire/mcap.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>

#include "wire/crc32.hpp"

namespace weldcell::wire {
namespace {

std::span<const std::byte> raw(std::string_view text) { return std::as_bytes(std::span(text)); }
std::string text(const Bytes& bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

/// A small file with everything: two channels, one with a schema, three chunks (one by flush, one of channels
/// only), two attachments, one of them empty.
void write_small(McapWriter& writer) {
  writer.begin("weldcell", "unit test");
  writer.attachment("cell.yaml", "application/yaml", {5}, "name: demo\n");
  const auto events = writer.channel("/events", "json", "event", "jsonschema", "{\"type\":\"object\"}");
  writer.message(events, 1, {1000}, raw("{\"a\":1}"));
  writer.message(events, 2, {3000}, raw("{\"a\":2}"));
  writer.flush();
  const auto bytes = writer.channel("/laser/rx", "application/octet-stream");
  writer.flush();
  writer.message(bytes, 3, {2000}, raw("SAEM"));
  writer.message(events, 3, {4000}, raw(""));
  writer.message(bytes, 4, {2500}, raw("1234567890"));
  writer.attachment("empty", "text/plain", {6}, "");
}

Bytes small_file(bool with_end = true) {
  Bytes out;
  McapWriter writer([&](std::span<const std::byte> b) { out.insert(out.end(), b.begin(), b.end()); });
  write_small(writer);
  if (with_end)
    writer.end();
  else
    writer.flush();
  return out;
}

struct Range {
  std::size_t from, to;
};

/// The byte ranges that an error's `where` names.
std::vector<Range> ranges(const Error& error) {
  std::vector<Range> out;
  const char* p = error.where.c_str();
  for (std::size_t i = 0; i < error.where.size(); ++i) {
    Range r{};
    if ((i == 0 || error.where[i - 1] == ' ') && std::sscanf(p + i, "%zu-%zu", &r.from, &r.to) == 2)
      out.push_back(r);
  }
  return out;
}

bool names(const Error& error, std::size_t byte) {
  const auto all = ranges(error);
  return std::any_of(all.begin(), all.end(), [&](const Range& r) { return r.from <= byte && byte < r.to; });
}

bool reported(const Result<McapFile>& file, std::size_t byte) {
  if (!file.ok()) return names(file.error(), byte);
  return std::any_of(file->damage.begin(), file->damage.end(),
                     [&](const Error& e) { return names(e, byte); });
}

std::string listing(const Result<McapFile>& file) {
  if (!file.ok()) return file.error().text();
  std::string out;
  for (const Error& e : file->damage) out += e.text() + "\n";
  return out;
}

TEST(Crc32, CheckValueOfTheStandard) {
  EXPECT_EQ(crc32(raw("123456789")), 0xCBF43926U);
  EXPECT_EQ(crc32({}), 0U);
  const std::string_view text = "The quick brown fox jumps over the lazy dog";
  EXPECT_EQ(crc32(raw(text)), 0x414FA339U);
  for (std::size_t cut = 0; cut <= text.size(); ++cut) {
    EXPECT_EQ(crc32(raw(text.substr(cut)), crc32(raw(text.substr(0, cut)))), 0x414FA339U);
  }
}

TEST(Mcap, WhatWasWrittenIsRead) {
  const auto file = read_mcap(small_file());
  ASSERT_TRUE(file.ok()) << file.error().text();
  EXPECT_TRUE(file->complete);
  EXPECT_TRUE(file->damage.empty()) << listing(file);
  EXPECT_EQ(file->profile, "weldcell");
  EXPECT_EQ(file->library, "unit test");
  ASSERT_EQ(file->messages.size(), 5U);
  EXPECT_EQ(file->messages[0].topic, "/events");
  EXPECT_EQ(file->messages[0].log_time.ns, 1000);
  EXPECT_EQ(text(file->messages[1].data), "{\"a\":2}");
  EXPECT_EQ(file->messages[2].topic, "/laser/rx");
  EXPECT_EQ(text(file->messages[2].data), "SAEM");
  EXPECT_EQ(file->messages[3].data.size(), 0U);
  EXPECT_EQ(file->messages[4].sequence, 4U);
  ASSERT_EQ(file->attachments.size(), 2U);
  EXPECT_EQ(file->attachments[0].name, "cell.yaml");
  EXPECT_EQ(file->attachments[0].media_type, "application/yaml");
  EXPECT_EQ(file->attachments[0].text, "name: demo\n");
  EXPECT_EQ(file->attachments[1].text, "");
}

TEST(Mcap, MessageOffsetsPointAtTheirRecords) {
  const Bytes bytes = small_file();
  const auto file = read_mcap(bytes);
  ASSERT_TRUE(file.ok());
  for (const McapMessage& message : file->messages) {
    EXPECT_EQ(bytes[message.file_offset], std::byte{5});
    const auto data = bytes.begin() + static_cast<std::ptrdiff_t>(message.file_offset) + 31;
    EXPECT_TRUE(std::equal(message.data.begin(), message.data.end(), data));
  }
}

TEST(Mcap, BeginsWithTheBytesOfTheFormat) {
  Bytes out;
  McapWriter writer([&](std::span<const std::byte> b) { out.insert(out.end(), b.begin(), b.end()); });
  writer.begin("ab", "c");
  writer.end();
  const unsigned char expected[] = {0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n',  // magic
                                    1,    11,  0,   0,   0,   0,   0,    0,    0, 2,
                                    0,    0,   0,   'a', 'b', 1,   0,    0,    0, 'c',  // header
                                    15,   4,   0,   0,   0,   0,   0,    0,    0};      // data end
  ASSERT_GE(out.size(), sizeof expected + 4);
  EXPECT_TRUE(std::equal(std::begin(expected), std::end(expected), out.begin(),
                         [](unsigned char a, std::byte b) { return static_cast<std::byte>(a) == b; }));
  const auto file = read_mcap(out);
  ASSERT_TRUE(file.ok());
  EXPECT_TRUE(file->complete);
  EXPECT_TRUE(file->messages.empty());
}

TEST(Mcap, ManyChunks) {
  Bytes out;
  McapWriter writer([&](std::span<const std::byte> b) { out.insert(out.end(), b.begin(), b.end()); }, 512);
  writer.begin("weldcell", "");
  const auto channel = writer.channel("/t", "json");
  for (std::uint32_t i = 0; i < 2000; ++i)
    writer.message(channel, i, {i * 4'000'000LL}, raw(std::to_string(i)));
  writer.end();
  const auto file = read_mcap(out);
  ASSERT_TRUE(file.ok());
  EXPECT_TRUE(file->damage.empty()) << listing(file);
  ASSERT_EQ(file->messages.size(), 2000U);
  for (std::uint32_t i = 0; i < 2000; ++i) EXPECT_EQ(text(file->messages[i].data), std::to_string(i));
}

TEST(Mcap, CutAnywhereReadsUpToTheLastWholeRecord) {
  for (const bool with_end : {true, false}) {
    const Bytes whole = small_file(with_end);
    const auto all = read_mcap(whole);
    ASSERT_TRUE(all.ok());
    EXPECT_EQ(all->complete, with_end);
    ASSERT_EQ(all->messages.size(), 5U);
    EXPECT_TRUE(all->damage.empty()) << listing(all);
    for (std::size_t n = 8; n < whole.size(); ++n) {
      const auto file = read_mcap(std::span(whole).first(n));
      ASSERT_TRUE(file.ok()) << n;
      EXPECT_FALSE(file->complete) << n;
      EXPECT_TRUE(file->damage.empty()) << n << ": " << listing(file);
      std::size_t expected = 0;
      for (const auto& m : all->messages) expected += m.file_offset + 31 + m.data.size() <= n ? 1 : 0;
      ASSERT_EQ(file->messages.size(), expected) << "cut at " << n;
      for (std::size_t i = 0; i < expected; ++i) EXPECT_EQ(file->messages[i].data, all->messages[i].data);
    }
  }
}

TEST(Mcap, FlushedMessagesSurviveWithoutAnEnd) {
  Bytes out;
  McapWriter writer([&](std::span<const std::byte> b) { out.insert(out.end(), b.begin(), b.end()); });
  writer.begin("weldcell", "");
  const auto channel = writer.channel("/t", "json");
  writer.message(channel, 1, {1}, raw("kept"));
  EXPECT_EQ(read_mcap(out)->messages.size(), 0U);
  writer.flush();
  EXPECT_EQ(read_mcap(out)->messages.size(), 1U);
}

TEST(Mcap, EveryChangedByteOfACompleteFileIsReportedAtItsPlace) {
  const Bytes good = small_file();
  std::size_t cases = 0;
  for (std::size_t at = 0; at < good.size(); ++at) {
    for (const unsigned flip : {0x01U, 0x02U, 0x80U, 0xFFU}) {
      Bytes bad = good;
      bad[at] ^= static_cast<std::byte>(flip);
      const auto file = read_mcap(bad);
      ASSERT_TRUE(reported(file, at)) << "byte " << at << " of " << good.size() << " xor " << flip << "\n"
                                      << listing(file);
      ++cases;
    }
  }
  EXPECT_EQ(cases, good.size() * 4);
}

TEST(Mcap, EveryChangedByteBehindTheHeaderOfACrashedFileIsReported) {
  const Bytes good = small_file(false);
  const std::size_t header_end = 8 + 9 + 4 + 8 + 4 + 9;
  for (std::size_t at = header_end; at < good.size(); ++at) {
    for (const unsigned flip : {0x01U, 0x80U, 0xFFU}) {
      Bytes bad = good;
      bad[at] ^= static_cast<std::byte>(flip);
      const auto file = read_mcap(bad);
      ASSERT_TRUE(reported(file, at)) << "byte " << at << " of " << good.size() << " xor " << flip << "\n"
                                      << listing(file);
    }
  }
}

TEST(Mcap, DamageLosesOnlyItsChunk) {
  const Bytes good = small_file();
  const auto all = read_mcap(good);
  ASSERT_TRUE(all.ok());
  Bytes bad = good;
  bad[all->messages[0].file_offset + 31] ^= std::byte{1};
  const auto file = read_mcap(bad);
  ASSERT_TRUE(file.ok());
  EXPECT_TRUE(file->complete);
  ASSERT_EQ(file->messages.size(), 3U);
  EXPECT_EQ(text(file->messages[0].data), "SAEM");
  EXPECT_EQ(file->messages[1].topic, "/events") << "the channel is known from the summary";
  EXPECT_EQ(file->attachments.size(), 2U);
  EXPECT_EQ(file->damage.size(), 1U) << listing(file);
}

TEST(Mcap, ChangedRecordLengthLosesNothing) {
  const Bytes good = small_file();
  const auto all = read_mcap(good);
  ASSERT_TRUE(all.ok());
  // The first chunk begins behind the first attachment.
  std::size_t chunk = 0;
  for (std::size_t i = 42; i < good.size() && chunk == 0; ++i) {
    if (good[i] == std::byte{6} && i + 49 + 9 < all->messages[0].file_offset) chunk = i;
  }
  ASSERT_GT(chunk, 0U);
  Bytes bad = good;
  bad[chunk + 8] = std::byte{0x40};
  const auto file = read_mcap(bad);
  ASSERT_TRUE(file.ok());
  EXPECT_EQ(file->messages.size(), 5U) << listing(file);
  EXPECT_EQ(file->damage.size(), 1U) << listing(file);
}

TEST(Mcap, WhatIsNoMcapIsAnError) {
  EXPECT_FALSE(read_mcap({}).ok());
  EXPECT_FALSE(read_mcap(raw("not a record")).ok());
  const auto file = read_mcap(raw("hello, this is a text file, quite long enough to be looked at"));
  ASSERT_FALSE(file.ok());
  EXPECT_EQ(file.error().code, "mcap.magic");
}

}  // namespace
}  // namespace weldcell::wire
