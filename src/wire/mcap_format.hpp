// MCAP's records as bytes: what writer and reader share, so that the reader can say what each redundant byte
// has to be. Pure. Source: the MCAP specification, version 0.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace weldcell::wire::mcap {

using Bytes = std::vector<std::byte>;
using View = std::span<const std::byte>;

inline constexpr std::array<std::byte, 8> kMagic{std::byte{0x89}, std::byte{'M'}, std::byte{'C'},
                                                 std::byte{'A'},  std::byte{'P'}, std::byte{'0'},
                                                 std::byte{'\r'}, std::byte{'\n'}};
inline constexpr std::string_view kOwnProfile = "weldcell";

enum class Op : std::uint8_t {
  Header = 0x01,
  Footer = 0x02,
  Schema = 0x03,
  Channel = 0x04,
  Message = 0x05,
  Chunk = 0x06,
  MessageIndex = 0x07,
  ChunkIndex = 0x08,
  Attachment = 0x09,
  AttachmentIndex = 0x0A,
  Statistics = 0x0B,
  Metadata = 0x0C,
  MetadataIndex = 0x0D,
  SummaryOffset = 0x0E,
  DataEnd = 0x0F
};

inline constexpr std::size_t kRecordHead = 9;    ///< opcode and length
inline constexpr std::size_t kChunkHead = 40;    ///< fields of an uncompressed chunk before its records
inline constexpr std::size_t kMessageHead = 22;  ///< fields of a message before its data
inline constexpr std::size_t kDataEndBytes = kRecordHead + 4;
inline constexpr std::size_t kFooterBytes = kRecordHead + 20;
inline constexpr std::size_t kTailBytes = kFooterBytes + kMagic.size();

/// Appends little-endian fields to bytes.
class Put {
 public:
  explicit Put(Bytes& out) : out_(out) {}
  void u8(std::uint8_t v) { out_.push_back(static_cast<std::byte>(v)); }
  void u16(std::uint16_t v) { number(v, 2); }
  void u32(std::uint32_t v) { number(v, 4); }
  void u64(std::uint64_t v) { number(v, 8); }
  void bytes(View v) { out_.insert(out_.end(), v.begin(), v.end()); }
  void text(std::string_view v) {
    u32(static_cast<std::uint32_t>(v.size()));
    bytes(std::as_bytes(std::span(v)));
  }
  /// Opens a record; close() fills in its length.
  std::size_t open(Op op);
  void close(std::size_t record);

 private:
  void number(std::uint64_t v, int size) {
    for (int i = 0; i < size; ++i) out_.push_back(static_cast<std::byte>(v >> (8 * i) & 0xFF));
  }
  Bytes& out_;
};

/// Reads little-endian fields; after the first one that is not there every answer is zero and ok() is false.
class Get {
 public:
  explicit Get(View in) : in_(in) {}
  std::uint8_t u8() { return static_cast<std::uint8_t>(number(1)); }
  std::uint16_t u16() { return static_cast<std::uint16_t>(number(2)); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(number(4)); }
  std::uint64_t u64() { return number(8); }
  View bytes(std::uint64_t size);
  std::string text();
  bool ok() const { return ok_; }
  std::size_t at() const { return at_; }
  std::size_t left() const { return in_.size() - at_; }

 private:
  std::uint64_t number(std::size_t size);
  View in_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

struct Schema {
  std::uint16_t id = 0;
  std::string name, encoding, data;
};

struct Channel {
  std::uint16_t id = 0, schema = 0;
  std::string topic, encoding;
};

/// A chunk and its message indexes, as the chunk index tells of them.
struct Chunk {
  std::uint64_t first_time = 0, last_time = 0, offset = 0, length = 0, records_size = 0, index_length = 0;
  std::map<std::uint16_t, std::uint64_t> index_offsets;
};

struct Attachment {
  std::uint64_t offset = 0, length = 0, log_time = 0, create_time = 0, data_size = 0;
  std::string name, media_type;
};

/// Where the messages of one chunk lie: per channel log time and offset inside the chunk's records.
using MessageIndexes = std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>>;

/// Everything that the summary says.
struct Summary {
  std::vector<Schema> schemas;
  std::vector<Channel> channels;
  std::vector<Chunk> chunks;
  std::vector<Attachment> attachments;
  std::map<std::uint16_t, std::uint64_t> message_counts;
};

void put_schema(Bytes& out, const Schema& schema);
void put_channel(Bytes& out, const Channel& channel);
/// The whole chunk record around `records`; fills in everything of `chunk` but the indexes.
Bytes chunk_record(View records, const MessageIndexes& indexes, std::uint64_t offset, Chunk& chunk);
/// The index records that follow that chunk; fills in the chunk's index fields.
Bytes index_records(const MessageIndexes& indexes, Chunk& chunk);
/// Everything behind the data end: summary, summary offsets, footer, magic.
Bytes tail(const Summary& summary, std::uint64_t offset);

/// False when the record's content is not exactly one schema / channel.
bool get_schema(View content, Schema& out);
bool get_channel(View content, Channel& out);

}  // namespace weldcell::wire::mcap
