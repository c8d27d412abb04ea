// Walks an MCAP file once; mcap_reader.cpp takes the records, mcap_checks.cpp finds ends, ways back and
// damage. Pure.
#pragma once

#include <fmt/format.h>

#include <array>
#include <string>
#include <unordered_map>

#include "weldcell/wire/mcap.hpp"
#include "wire/mcap_format.hpp"

namespace weldcell::wire::mcap {

inline constexpr const char* kMend = "use another copy of the file; the other parts were read";

struct Record {
  Op op{};
  std::size_t at = 0;  ///< of the opcode
  View content;
  std::size_t end() const { return at + kRecordHead + content.size(); }
};

/// The three lengths that an uncompressed chunk states, and what belongs to them.
struct ChunkHead {
  std::uint64_t first_time = 0, last_time = 0;
  std::uint32_t crc = 0, compression_size = 0;
  std::array<std::uint64_t, 3> sizes{};  ///< by record length, uncompressed size, records length
  /// The size on which at least two agree; false when no two do.
  bool agreed(std::uint64_t& size) const {
    for (std::size_t i = 0; i < 3; ++i) {
      size = sizes[i];
      if (sizes[i] == sizes[(i + 1) % 3]) return true;
    }
    return false;
  }
  bool consistent() const { return compression_size == 0 && sizes[0] == sizes[1] && sizes[1] == sizes[2]; }
};

class Reader {
 public:
  explicit Reader(View file) : file_(file) {}
  Result<McapFile> read();

 private:
  View slice(std::size_t from, std::size_t to) const { return file_.subspan(from, to - from); }
  std::uint8_t opcode(std::size_t at) const { return static_cast<std::uint8_t>(file_[at]); }
  std::uint64_t length(std::size_t at) const { return Get(file_.subspan(at + 1, 8)).u64(); }
  bool own() const { return out_.profile == kOwnProfile; }

  void damage(const char* code, std::size_t from, std::size_t to, std::string what) {
    out_.damage.push_back({code, fmt::format("bytes {}-{}", from, to), std::move(what), kMend});
  }

  void look_at_end();
  std::size_t read_header();
  void read_data(std::size_t at);
  /// Handles the record there; answers where the next one begins, or file size to stop.
  std::size_t step(std::size_t at);
  std::size_t take_chunk(std::size_t at);
  std::size_t take_whole_chunk(std::size_t at, const ChunkHead& head, std::size_t size);
  std::size_t behind_indexes(std::size_t at) const;
  std::size_t take_indexes(std::size_t at, const MessageIndexes& indexes, Chunk& chunk);
  std::size_t take_attachment(std::size_t at);
  std::size_t take_other(std::size_t at);
  void take_records(std::size_t from, std::size_t to, MessageIndexes& indexes);
  bool take_record(const Record& record, std::size_t chunk_start, MessageIndexes& indexes);
  void take_data_end(std::size_t at);
  void check_tail(std::size_t at);
  void check_foreign_tail(std::size_t at);
  void learn_channels();
  std::size_t resync(std::size_t at);

  bool chunk_head(std::size_t at, ChunkHead& out) const;
  bool whole_chunk_at(std::size_t at) const;
  bool attachment_at(std::size_t at, McapAttachment& out, Attachment& index) const;
  bool data_end_at(std::size_t at) const;

  View file_;
  McapFile out_;
  Summary summary_;                                   ///< as the data say
  std::unordered_map<std::uint16_t, Channel> known_;  ///< also those that only the summary tells of
  std::size_t limit_ = 0;                             ///< end of what can be data or summary
  bool ended_ = false;                                ///< footer or final magic are there
  std::size_t summary_start_ = 0, header_end_ = 0;
  bool stop_ = false;
};

}  // namespace weldcell::wire::mcap
