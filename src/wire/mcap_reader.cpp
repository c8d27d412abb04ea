#include <algorithm>
#include <array>
#include <unordered_map>

#include <fmt/format.h>

#include "weldcell/wire/mcap.hpp"
#include "wire/crc32.hpp"
#include "wire/mcap_format.hpp"

namespace weldcell::wire {
namespace {

using mcap::Get;
using mcap::kChunkHead;
using mcap::kMagic;
using mcap::kRecordHead;
using mcap::Op;
using mcap::View;

constexpr const char* kMend = "use another copy of the file; the other parts were read";

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
  bool own() const { return out_.profile == mcap::kOwnProfile; }

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
  std::size_t take_indexes(std::size_t at, const mcap::MessageIndexes& indexes, mcap::Chunk& chunk);
  std::size_t take_attachment(std::size_t at);
  std::size_t take_other(std::size_t at);
  void take_records(std::size_t from, std::size_t to, mcap::MessageIndexes& indexes);
  bool take_record(const Record& record, std::size_t chunk_start, mcap::MessageIndexes& indexes);
  void take_data_end(std::size_t at);
  void check_tail(std::size_t at);
  void check_foreign_tail(std::size_t at);
  void learn_channels();
  std::size_t resync(std::size_t at);

  bool chunk_head(std::size_t at, ChunkHead& out) const;
  bool whole_chunk_at(std::size_t at) const;
  bool attachment_at(std::size_t at, McapAttachment& out, mcap::Attachment& index) const;
  bool data_end_at(std::size_t at) const;

  View file_;
  McapFile out_;
  mcap::Summary summary_;                                   ///< as the data say
  std::unordered_map<std::uint16_t, mcap::Channel> known_;  ///< also those that only the summary tells of
  std::size_t limit_ = 0;                                   ///< end of what can be data or summary
  bool ended_ = false;                                      ///< footer or final magic are there
  std::size_t summary_start_ = 0, header_end_ = 0;
  bool stop_ = false;
};

Result<McapFile> Reader::read() {
  const std::size_t magic = std::min(file_.size(), kMagic.size());
  std::size_t same = 0;
  for (std::size_t i = 0; i < magic; ++i) same += file_[i] == kMagic[i] ? 1 : 0;
  if (same + 1 < kMagic.size() || file_.size() < kMagic.size()) {
    return Error{"mcap.magic", "bytes 0-8", "not an MCAP file", "give the record.mcap of a job"};
  }
  if (same < kMagic.size()) damage("mcap.magic", 0, kMagic.size(), "the file's first bytes are not MCAP's");
  look_at_end();
  learn_channels();
  const std::size_t data = read_header();
  if (!stop_) read_data(data);
  return std::move(out_);
}

void Reader::look_at_end() {
  limit_ = file_.size();
  if (file_.size() < kMagic.size() + mcap::kTailBytes) return;
  const std::size_t footer = file_.size() - mcap::kTailBytes;
  const bool has_footer = opcode(footer) == static_cast<std::uint8_t>(Op::Footer) && length(footer) == 20;
  const bool has_magic =
      std::equal(kMagic.begin(), kMagic.end(), file_.end() - static_cast<std::ptrdiff_t>(kMagic.size()));
  ended_ = has_footer || has_magic;
  out_.complete = ended_;
  if (!ended_) return;
  limit_ = footer;
  const std::uint64_t start = Get(file_.subspan(footer + kRecordHead, 8)).u64();
  if (start >= kMagic.size() + mcap::kDataEndBytes && start <= footer)
    summary_start_ = static_cast<std::size_t>(start);
}

/// A damaged chunk may hold the only other copy of a channel; the summary's is as good when its checksum
/// holds.
void Reader::learn_channels() {
  if (summary_start_ == 0) return;
  const std::size_t crc_at = limit_ + mcap::kFooterBytes - 4;
  if (Get(file_.subspan(crc_at, 4)).u32() != crc32(slice(summary_start_, crc_at))) return;
  for (std::size_t at = summary_start_; limit_ - at >= kRecordHead;) {
    const std::uint64_t size = length(at);
    if (size > limit_ - at - kRecordHead) return;
    mcap::Channel channel;
    const View content = file_.subspan(at + kRecordHead, static_cast<std::size_t>(size));
    if (opcode(at) == static_cast<std::uint8_t>(Op::Channel) && mcap::get_channel(content, channel)) {
      known_[channel.id] = channel;
    }
    at += kRecordHead + static_cast<std::size_t>(size);
  }
}

std::size_t Reader::read_header() {
  const std::size_t at = kMagic.size();
  if (file_.size() - at < kRecordHead) {
    stop_ = true;
    return at;
  }
  Get get(file_.subspan(at + kRecordHead));
  out_.profile = get.text();
  out_.library = get.text();
  header_end_ = at + kRecordHead + get.at();
  const bool sound =
      opcode(at) == static_cast<std::uint8_t>(Op::Header) && get.ok() && length(at) >= get.at();
  if (!get.ok() && !ended_ && length(at) > file_.size() - at - kRecordHead) {
    stop_ = true;
    return at;
  }
  if (sound && length(at) == get.at()) return header_end_;
  if (sound && length(at) <= limit_ - at - kRecordHead && !own())
    return at + kRecordHead + static_cast<std::size_t>(length(at));
  if (get.ok()) {
    damage("mcap.frame", at, header_end_, "the header is damaged");
    return header_end_;
  }
  return resync(at);
}

void Reader::read_data(std::size_t at) {
  while (!stop_ && at < limit_) {
    if (limit_ - at < kRecordHead) {
      if (ended_) damage("mcap.frame", at, limit_, "bytes that are no record");
      return;
    }
    at = step(at);
  }
  if (!stop_ && ended_)
    damage("mcap.frame", std::min(at, limit_), limit_ + mcap::kFooterBytes, "the end of the data is missing");
}

std::size_t Reader::step(std::size_t at) {
  if (data_end_at(at)) {
    take_data_end(at);
    return file_.size();
  }
  switch (static_cast<Op>(opcode(at))) {
    case Op::Chunk:
      return take_chunk(at);
    case Op::Attachment:
      return take_attachment(at);
    default:
      return take_other(at);
  }
}

bool Reader::data_end_at(std::size_t at) const {
  const bool sound = opcode(at) == static_cast<std::uint8_t>(Op::DataEnd) && length(at) == 4 &&
                     file_.size() - at >= mcap::kDataEndBytes;
  return sound || (ended_ && at + mcap::kDataEndBytes == summary_start_);
}

bool Reader::chunk_head(std::size_t at, ChunkHead& out) const {
  Get get(file_.subspan(at + 1));
  const std::uint64_t record = get.u64();
  out.first_time = get.u64();
  out.last_time = get.u64();
  out.sizes[1] = get.u64();
  out.crc = get.u32();
  out.compression_size = get.u32();
  out.sizes[2] = get.u64();
  out.sizes[0] = record - kChunkHead;
  return get.ok() && record >= kChunkHead;
}

std::size_t Reader::take_chunk(std::size_t at) {
  ChunkHead head;
  const std::size_t records = at + kRecordHead + kChunkHead;
  if (!chunk_head(at, head)) {
    const bool cut = !ended_ && file_.size() < records;
    if (!cut) return resync(at);
    stop_ = true;
    return file_.size();
  }
  std::uint64_t size = 0;
  if (!head.agreed(size)) return resync(at);
  if (records > limit_ || size > limit_ - records) {
    if (ended_ || !head.consistent()) return resync(at);
    // Cut in the middle: the records that are whole are still good.
    mcap::MessageIndexes indexes;
    take_records(records, file_.size(), indexes);
    stop_ = true;
    return file_.size();
  }
  if (!head.consistent())
    damage("mcap.frame", at, records, "a chunk's lengths disagree, or it is compressed");
  return take_whole_chunk(at, head, static_cast<std::size_t>(size));
}

std::size_t Reader::take_whole_chunk(std::size_t at, const ChunkHead& head, std::size_t size) {
  const std::size_t records = at + kRecordHead + kChunkHead, end = records + size;
  const View body = file_.subspan(records, size);
  if (head.crc != crc32(body) && (head.crc != 0 || own())) {
    const std::size_t next = behind_indexes(end);
    damage("mcap.crc", at, next, "a chunk's checksum does not fit its content");
    return next;
  }
  mcap::MessageIndexes indexes;
  take_records(records, end, indexes);
  mcap::Chunk chunk;
  const Bytes expected = mcap::chunk_record(body, indexes, at, chunk);
  if (head.first_time != chunk.first_time || head.last_time != chunk.last_time) {
    damage("mcap.field", at + kRecordHead, at + kRecordHead + 16,
           "a chunk's times are not those of its messages");
  }
  const std::size_t next = own() ? take_indexes(end, indexes, chunk) : end;
  summary_.chunks.push_back(std::move(chunk));
  return next;
}

/// Where the index records end that begin there, whatever they say.
std::size_t Reader::behind_indexes(std::size_t at) const {
  while (limit_ - at >= kRecordHead && opcode(at) == static_cast<std::uint8_t>(Op::MessageIndex) &&
         length(at) <= limit_ - at - kRecordHead) {
    at += kRecordHead + static_cast<std::size_t>(length(at));
  }
  return at;
}

std::size_t Reader::take_indexes(std::size_t at, const mcap::MessageIndexes& indexes, mcap::Chunk& chunk) {
  const Bytes expected = mcap::index_records(indexes, chunk);
  const std::size_t there = std::min(expected.size(), limit_ - at);
  const View found = file_.subspan(at, there);
  const auto first = std::mismatch(found.begin(), found.end(), expected.begin()).first;
  if (first != found.end()) {
    const auto from = static_cast<std::size_t>(first - found.begin());
    damage("mcap.index", at + from, at + there, "the index behind a chunk does not fit the chunk");
  } else if (there < expected.size() && ended_) {
    damage("mcap.index", at, limit_, "the index behind a chunk is cut short");
  }
  if (there < expected.size()) stop_ = true;
  return at + there;
}

void Reader::take_records(std::size_t from, std::size_t to, mcap::MessageIndexes& indexes) {
  const bool cut = to == file_.size();
  for (std::size_t at = from; at < to;) {
    const bool fits = to - at >= kRecordHead && length(at) <= to - at - kRecordHead;
    if (!fits) {
      if (!cut) damage("mcap.frame", at, to, "bytes in a chunk that are no record");
      return;
    }
    const Record record{static_cast<Op>(opcode(at)), at,
                        file_.subspan(at + kRecordHead, static_cast<std::size_t>(length(at)))};
    if (!take_record(record, from, indexes))
      damage("mcap.record", at, record.end(), "a record in a chunk cannot be read");
    at = record.end();
  }
}

bool Reader::take_record(const Record& record, std::size_t chunk_start, mcap::MessageIndexes& indexes) {
  if (record.op == Op::Schema) {
    mcap::Schema schema;
    if (!mcap::get_schema(record.content, schema)) return false;
    summary_.schemas.push_back(std::move(schema));
    return true;
  }
  if (record.op == Op::Channel) {
    mcap::Channel channel;
    if (!mcap::get_channel(record.content, channel)) return false;
    if (known_.count(channel.id) != 0 && known_[channel.id].topic != channel.topic) return false;
    known_[channel.id] = channel;
    const auto same = [&](const mcap::Channel& c) { return c.id == channel.id; };
    if (std::none_of(summary_.channels.begin(), summary_.channels.end(), same))
      summary_.channels.push_back(channel);
    return true;
  }
  if (record.op != Op::Message) return !own();
  Get get(record.content);
  const std::uint16_t channel = get.u16();
  McapMessage message;
  message.sequence = get.u32();
  const std::uint64_t time = get.u64();
  get.u64();
  const auto known = known_.find(channel);
  if (!get.ok() || known == known_.end()) return false;
  const View data = get.bytes(get.left());
  message.topic = known->second.topic;
  message.log_time.ns = static_cast<Nanoseconds>(time);
  message.data.assign(data.begin(), data.end());
  message.file_offset = record.at;
  out_.messages.push_back(std::move(message));
  indexes[channel].emplace_back(time, record.at - chunk_start);
  ++summary_.message_counts[channel];
  return true;
}

bool Reader::attachment_at(std::size_t at, McapAttachment& out, mcap::Attachment& index) const {
  Get get(file_.subspan(at + kRecordHead));
  index.offset = at;
  index.log_time = get.u64();
  index.create_time = get.u64();
  index.name = out.name = get.text();
  index.media_type = out.media_type = get.text();
  index.data_size = get.u64();
  const View data = get.bytes(index.data_size);
  const std::size_t covered = get.at();
  const std::uint32_t crc = get.u32();
  if (!get.ok() || at + kRecordHead + get.at() > limit_ || length(at) != get.at()) return false;
  if (crc != crc32(file_.subspan(at + kRecordHead, covered)) && (crc != 0 || own())) return false;
  out.text.assign(reinterpret_cast<const char*>(data.data()), data.size());
  index.length = kRecordHead + get.at();
  return true;
}

std::size_t Reader::take_attachment(std::size_t at) {
  McapAttachment attachment;
  mcap::Attachment index;
  if (attachment_at(at, attachment, index)) {
    out_.attachments.push_back(std::move(attachment));
    const std::size_t end = at + static_cast<std::size_t>(index.length);
    summary_.attachments.push_back(std::move(index));
    return end;
  }
  const std::uint64_t size = length(at);
  if (!ended_ && size > limit_ - at - kRecordHead) {
    // Cut in the middle, unless what follows says that the length is wrong.
    const std::size_t next = resync(at);
    if (stop_) out_.damage.pop_back();
    return next;
  }
  return resync(at);
}

std::size_t Reader::take_other(std::size_t at) {
  const std::uint64_t size = length(at);
  const bool fits = size <= limit_ - at - kRecordHead;
  const auto op = static_cast<Op>(opcode(at));
  const bool cut_data_end = op == Op::DataEnd && size == 4;
  if (!fits && !ended_ && (!own() || cut_data_end)) {
    stop_ = true;
    return file_.size();
  }
  if (own() || !fits || opcode(at) == 0) return resync(at);
  mcap::MessageIndexes unindexed;
  const Record record{op, at, file_.subspan(at + kRecordHead, static_cast<std::size_t>(size))};
  if ((op == Op::Schema || op == Op::Channel || op == Op::Message) && !take_record(record, at, unindexed)) {
    damage("mcap.record", at, record.end(), "a record cannot be read");
  }
  return record.end();
}

void Reader::take_data_end(std::size_t at) {
  const std::size_t end = at + mcap::kDataEndBytes;
  stop_ = true;
  const bool sound = opcode(at) == static_cast<std::uint8_t>(Op::DataEnd) && length(at) == 4;
  if (!sound) damage("mcap.frame", at, end, "the record that ends the data is damaged");
  const std::uint32_t crc = Get(file_.subspan(at + kRecordHead, 4)).u32();
  const bool right = crc == crc32(file_.first(at)) || (crc == 0 && !own());
  if (sound && !right && out_.damage.empty()) {
    // Chunks and attachments have checksums of their own and hold; what is left is the header, or the sum
    // itself.
    out_.damage.push_back(
        {"mcap.crc", fmt::format("bytes {}-{} or {}-{}", kMagic.size(), own() ? header_end_ : at, at, end),
         "the checksum of the data does not fit, though every part does", kMend});
  }
  if (own() && out_.damage.empty())
    check_tail(end);
  else if (ended_)
    check_foreign_tail(end);
}

void Reader::check_tail(std::size_t at) {
  const Bytes expected = mcap::tail(summary_, at);
  const View found = file_.subspan(at);
  const std::size_t there = std::min(expected.size(), found.size());
  const auto first =
      std::mismatch(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(there), expected.begin())
          .first;
  const auto from = static_cast<std::size_t>(first - found.begin());
  if (from < there)
    damage("mcap.summary", at + from, file_.size(), "the summary does not fit the data");
  else if (found.size() > expected.size())
    damage("mcap.frame", at + there, file_.size(), "bytes behind the end");
}

void Reader::check_foreign_tail(std::size_t at) {
  const std::size_t crc_at = limit_ + mcap::kFooterBytes - 4;
  const std::uint32_t crc = Get(file_.subspan(crc_at, 4)).u32();
  const std::size_t from = std::min(at, limit_);
  if (crc != 0 && summary_start_ != 0 && crc != crc32(slice(summary_start_, crc_at))) {
    damage("mcap.summary", from, limit_ + mcap::kFooterBytes, "the checksum of the summary does not fit");
  }
  const std::size_t magic = file_.size() - kMagic.size();
  if (!std::equal(kMagic.begin(), kMagic.end(), file_.begin() + static_cast<std::ptrdiff_t>(magic))) {
    damage("mcap.magic", magic, file_.size(), "the file's last bytes are not MCAP's");
  }
}

bool Reader::whole_chunk_at(std::size_t at) const {
  ChunkHead head;
  if (opcode(at) != static_cast<std::uint8_t>(Op::Chunk) || !chunk_head(at, head) || !head.consistent())
    return false;
  const std::size_t records = at + kRecordHead + kChunkHead;
  if (records > limit_ || head.sizes[0] > limit_ - records) return false;
  return head.crc == crc32(file_.subspan(records, static_cast<std::size_t>(head.sizes[0])));
}

std::size_t Reader::resync(std::size_t at) {
  McapAttachment attachment;
  mcap::Attachment index;
  std::size_t next = at + 1;
  for (; next + kRecordHead <= limit_; ++next) {
    const bool found =
        data_end_at(next) || whole_chunk_at(next) ||
        (opcode(next) == static_cast<std::uint8_t>(Op::Attachment) && attachment_at(next, attachment, index));
    if (found) break;
  }
  if (next + kRecordHead > limit_) {
    next = limit_;
    stop_ = true;
  }
  damage("mcap.frame", at, next, "bytes that are no record");
  return next;
}

}  // namespace

Result<McapFile> read_mcap(std::span<const std::byte> file) { return Reader(file).read(); }

}  // namespace weldcell::wire
