#include "wire/mcap_reader.hpp"

#include <algorithm>

#include "wire/crc32.hpp"

namespace weldcell::wire::mcap {

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
    damage("mcap.frame", std::min(at, limit_), limit_ + kFooterBytes, "the end of the data is missing");
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
    MessageIndexes indexes;
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
  MessageIndexes indexes;
  take_records(records, end, indexes);
  Chunk chunk;
  const Bytes expected = chunk_record(body, indexes, at, chunk);
  if (head.first_time != chunk.first_time || head.last_time != chunk.last_time) {
    damage("mcap.field", at + kRecordHead, at + kRecordHead + 16,
           "a chunk's times are not those of its messages");
  }
  const std::size_t next = own() ? take_indexes(end, indexes, chunk) : end;
  summary_.chunks.push_back(std::move(chunk));
  return next;
}

std::size_t Reader::take_indexes(std::size_t at, const MessageIndexes& indexes, Chunk& chunk) {
  const Bytes expected = index_records(indexes, chunk);
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

void Reader::take_records(std::size_t from, std::size_t to, MessageIndexes& indexes) {
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

bool Reader::take_record(const Record& record, std::size_t chunk_start, MessageIndexes& indexes) {
  if (record.op == Op::Schema) {
    Schema schema;
    if (!get_schema(record.content, schema)) return false;
    summary_.schemas.push_back(std::move(schema));
    return true;
  }
  if (record.op == Op::Channel) {
    Channel channel;
    if (!get_channel(record.content, channel)) return false;
    if (known_.count(channel.id) != 0 && known_[channel.id].topic != channel.topic) return false;
    known_[channel.id] = channel;
    const auto same = [&](const Channel& c) { return c.id == channel.id; };
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

bool Reader::attachment_at(std::size_t at, McapAttachment& out, Attachment& index) const {
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
  Attachment index;
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
  MessageIndexes unindexed;
  const Record record{op, at, file_.subspan(at + kRecordHead, static_cast<std::size_t>(size))};
  if ((op == Op::Schema || op == Op::Channel || op == Op::Message) && !take_record(record, at, unindexed)) {
    damage("mcap.record", at, record.end(), "a record cannot be read");
  }
  return record.end();
}

}  // namespace weldcell::wire::mcap

namespace weldcell::wire {

Result<McapFile> read_mcap(std::span<const std::byte> file) { return mcap::Reader(file).read(); }

}  // namespace weldcell::wire
