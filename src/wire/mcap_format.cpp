#include "wire/mcap_format.hpp"

#include <algorithm>
#include <limits>

#include "wire/crc32.hpp"

namespace weldcell::wire::mcap {
namespace {

struct TimeRange {
  std::uint64_t first = 0, last = 0;
};

TimeRange times_of(const MessageIndexes& indexes) {
  TimeRange range{std::numeric_limits<std::uint64_t>::max(), 0};
  bool any = false;
  for (const auto& [channel, entries] : indexes) {
    for (const auto& [time, offset] : entries) {
      range = {std::min(range.first, time), std::max(range.last, time)};
      any = true;
    }
  }
  return any ? range : TimeRange{};
}

TimeRange times_of(const std::vector<Chunk>& chunks) {
  TimeRange range{std::numeric_limits<std::uint64_t>::max(), 0};
  bool any = false;
  for (const Chunk& chunk : chunks) {
    if (chunk.index_offsets.empty()) continue;
    range = {std::min(range.first, chunk.first_time), std::max(range.last, chunk.last_time)};
    any = true;
  }
  return any ? range : TimeRange{};
}

void put_counts(Put& put, const std::map<std::uint16_t, std::uint64_t>& numbers) {
  put.u32(static_cast<std::uint32_t>(numbers.size() * 10));
  for (const auto& [key, value] : numbers) {
    put.u16(key);
    put.u64(value);
  }
}

void put_chunk_index(Put& put, const Chunk& chunk) {
  const std::size_t record = put.open(Op::ChunkIndex);
  put.u64(chunk.first_time);
  put.u64(chunk.last_time);
  put.u64(chunk.offset);
  put.u64(chunk.length);
  put_counts(put, chunk.index_offsets);
  put.u64(chunk.index_length);
  put.text("");
  put.u64(chunk.records_size);
  put.u64(chunk.records_size);
  put.close(record);
}

void put_attachment_index(Put& put, const Attachment& attachment) {
  const std::size_t record = put.open(Op::AttachmentIndex);
  put.u64(attachment.offset);
  put.u64(attachment.length);
  put.u64(attachment.log_time);
  put.u64(attachment.create_time);
  put.u64(attachment.data_size);
  put.text(attachment.name);
  put.text(attachment.media_type);
  put.close(record);
}

void put_statistics(Put& put, const Summary& summary) {
  std::uint64_t messages = 0;
  for (const auto& [channel, count] : summary.message_counts) messages += count;
  const TimeRange times = times_of(summary.chunks);
  const std::size_t record = put.open(Op::Statistics);
  put.u64(messages);
  put.u16(static_cast<std::uint16_t>(summary.schemas.size()));
  put.u32(static_cast<std::uint32_t>(summary.channels.size()));
  put.u32(static_cast<std::uint32_t>(summary.attachments.size()));
  put.u32(0);
  put.u32(static_cast<std::uint32_t>(summary.chunks.size()));
  put.u64(times.first);
  put.u64(times.last);
  put_counts(put, summary.message_counts);
  put.close(record);
}

}  // namespace

std::size_t Put::open(Op op) {
  const std::size_t record = out_.size();
  u8(static_cast<std::uint8_t>(op));
  u64(0);
  return record;
}

void Put::close(std::size_t record) {
  const std::uint64_t length = out_.size() - record - kRecordHead;
  for (std::size_t i = 0; i < 8; ++i) out_[record + 1 + i] = static_cast<std::byte>(length >> (8 * i) & 0xFF);
}

std::uint64_t Get::number(std::size_t size) {
  if (!ok_ || left() < size) {
    ok_ = false;
    return 0;
  }
  std::uint64_t v = 0;
  for (std::size_t i = 0; i < size; ++i) v |= static_cast<std::uint64_t>(in_[at_ + i]) << (8 * i);
  at_ += size;
  return v;
}

View Get::bytes(std::uint64_t size) {
  if (!ok_ || left() < size) {
    ok_ = false;
    return {};
  }
  const View out = in_.subspan(at_, static_cast<std::size_t>(size));
  at_ += out.size();
  return out;
}

std::string Get::text() {
  const View raw = bytes(u32());
  return {reinterpret_cast<const char*>(raw.data()), raw.size()};
}

void put_schema(Bytes& out, const Schema& schema) {
  Put put(out);
  const std::size_t record = put.open(Op::Schema);
  put.u16(schema.id);
  put.text(schema.name);
  put.text(schema.encoding);
  put.text(schema.data);
  put.close(record);
}

void put_channel(Bytes& out, const Channel& channel) {
  Put put(out);
  const std::size_t record = put.open(Op::Channel);
  put.u16(channel.id);
  put.u16(channel.schema);
  put.text(channel.topic);
  put.text(channel.encoding);
  put.u32(0);
  put.close(record);
}

Bytes chunk_record(View records, const MessageIndexes& indexes, std::uint64_t offset, Chunk& chunk) {
  const TimeRange times = times_of(indexes);
  Bytes out;
  out.reserve(kRecordHead + kChunkHead + records.size());
  Put put(out);
  const std::size_t record = put.open(Op::Chunk);
  put.u64(times.first);
  put.u64(times.last);
  put.u64(records.size());
  put.u32(crc32(records));
  put.text("");
  put.u64(records.size());
  put.bytes(records);
  put.close(record);
  chunk.first_time = times.first;
  chunk.last_time = times.last;
  chunk.offset = offset;
  chunk.length = out.size();
  chunk.records_size = records.size();
  return out;
}

Bytes index_records(const MessageIndexes& indexes, Chunk& chunk) {
  Bytes out;
  Put put(out);
  chunk.index_offsets.clear();
  for (const auto& [channel, entries] : indexes) {
    chunk.index_offsets[channel] = chunk.offset + chunk.length + out.size();
    const std::size_t record = put.open(Op::MessageIndex);
    put.u16(channel);
    put.u32(static_cast<std::uint32_t>(entries.size() * 16));
    for (const auto& [time, offset] : entries) {
      put.u64(time);
      put.u64(offset);
    }
    put.close(record);
  }
  chunk.index_length = out.size();
  return out;
}

Bytes tail(const Summary& summary, std::uint64_t offset) {
  struct Group {
    Op op;
    std::uint64_t start, length;
  };
  std::vector<Group> groups;
  Bytes out;
  Put put(out);
  const auto group = [&](Op op, auto&& write) {
    const std::size_t start = out.size();
    write();
    if (out.size() > start) groups.push_back({op, offset + start, out.size() - start});
  };
  group(Op::Schema, [&] {
    for (const Schema& s : summary.schemas) put_schema(out, s);
  });
  group(Op::Channel, [&] {
    for (const Channel& c : summary.channels) put_channel(out, c);
  });
  group(Op::Statistics, [&] { put_statistics(put, summary); });
  group(Op::ChunkIndex, [&] {
    for (const Chunk& c : summary.chunks) put_chunk_index(put, c);
  });
  group(Op::AttachmentIndex, [&] {
    for (const Attachment& a : summary.attachments) put_attachment_index(put, a);
  });
  const std::uint64_t offsets_start = offset + out.size();
  for (const Group& g : groups) {
    const std::size_t record = put.open(Op::SummaryOffset);
    put.u8(static_cast<std::uint8_t>(g.op));
    put.u64(g.start);
    put.u64(g.length);
    put.close(record);
  }
  const std::size_t footer = put.open(Op::Footer);
  put.u64(offset);
  put.u64(offsets_start);
  out.resize(out.size() + 4);
  put.close(footer);
  out.resize(out.size() - 4);
  put.u32(crc32(out));
  put.bytes(kMagic);
  return out;
}

bool get_schema(View content, Schema& out) {
  Get get(content);
  out.id = get.u16();
  out.name = get.text();
  out.encoding = get.text();
  out.data = get.text();
  return get.ok() && get.left() == 0;
}

bool get_channel(View content, Channel& out) {
  Get get(content);
  out.id = get.u16();
  out.schema = get.u16();
  out.topic = get.text();
  out.encoding = get.text();
  get.bytes(get.u32());
  return get.ok() && get.left() == 0;
}

}  // namespace weldcell::wire::mcap
