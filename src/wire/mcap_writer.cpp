#include "weldcell/wire/mcap.hpp"

#include "weldcell/base/assert.hpp"
#include "wire/crc32.hpp"
#include "wire/mcap_format.hpp"

namespace weldcell::wire {

using mcap::Op;
using mcap::Put;

struct McapWriter::State {
  Sink sink;
  std::size_t chunk_bytes;
  std::uint64_t offset = 0;
  std::uint32_t data_crc = 0;
  bool begun = false, ended = false;
  Bytes records;  ///< of the chunk at hand
  mcap::MessageIndexes indexes;
  mcap::Summary summary;

  void write(std::span<const std::byte> bytes) {
    data_crc = crc32(bytes, data_crc);
    offset += bytes.size();
    sink(bytes);
  }
};

McapWriter::McapWriter(Sink sink, std::size_t chunk_bytes) : state_(std::make_unique<State>()) {
  state_->sink = std::move(sink);
  state_->chunk_bytes = chunk_bytes;
}

McapWriter::~McapWriter() = default;

void McapWriter::begin(std::string_view profile, std::string_view library) {
  WELDCELL_ASSERT(!state_->begun);
  state_->begun = true;
  Bytes out(mcap::kMagic.begin(), mcap::kMagic.end());
  Put put(out);
  const std::size_t record = put.open(Op::Header);
  put.text(profile);
  put.text(library);
  put.close(record);
  state_->write(out);
}

std::uint16_t McapWriter::channel(std::string_view topic, std::string_view encoding,
                                  std::string_view schema_name, std::string_view schema_encoding,
                                  std::string_view schema) {
  WELDCELL_ASSERT(state_->begun && !state_->ended && state_->summary.channels.size() < 0xFFFF);
  mcap::Channel channel;
  channel.id = static_cast<std::uint16_t>(state_->summary.channels.size() + 1);
  channel.topic = topic;
  channel.encoding = encoding;
  if (!schema_name.empty()) {
    mcap::Schema s;
    s.id = static_cast<std::uint16_t>(state_->summary.schemas.size() + 1);
    s.name = schema_name;
    s.encoding = schema_encoding;
    s.data = schema;
    channel.schema = s.id;
    mcap::put_schema(state_->records, s);
    state_->summary.schemas.push_back(std::move(s));
  }
  mcap::put_channel(state_->records, channel);
  state_->summary.channels.push_back(channel);
  return channel.id;
}

void McapWriter::message(std::uint16_t channel, std::uint32_t sequence, HostTime log_time,
                         std::span<const std::byte> data) {
  State& s = *state_;
  WELDCELL_ASSERT(s.begun && !s.ended && channel >= 1 && channel <= s.summary.channels.size());
  const auto time = static_cast<std::uint64_t>(log_time.ns);
  s.indexes[channel].emplace_back(time, s.records.size());
  Put put(s.records);
  const std::size_t record = put.open(Op::Message);
  put.u16(channel);
  put.u32(sequence);
  put.u64(time);
  put.u64(time);
  put.bytes(data);
  put.close(record);
  ++s.summary.message_counts[channel];
  if (s.records.size() >= s.chunk_bytes) flush();
}

void McapWriter::attachment(std::string_view name, std::string_view media_type, HostTime log_time,
                            std::string_view text) {
  State& s = *state_;
  WELDCELL_ASSERT(s.begun && !s.ended);
  mcap::Attachment attachment;
  attachment.offset = s.offset;
  attachment.log_time = static_cast<std::uint64_t>(log_time.ns);
  attachment.create_time = attachment.log_time;
  attachment.data_size = text.size();
  attachment.name = name;
  attachment.media_type = media_type;
  Bytes out;
  Put put(out);
  const std::size_t record = put.open(Op::Attachment);
  put.u64(attachment.log_time);
  put.u64(attachment.create_time);
  put.text(name);
  put.text(media_type);
  put.u64(text.size());
  put.bytes(std::as_bytes(std::span(text)));
  put.u32(crc32(std::span(out).subspan(mcap::kRecordHead)));
  put.close(record);
  attachment.length = out.size();
  s.summary.attachments.push_back(std::move(attachment));
  s.write(out);
}

void McapWriter::flush() {
  State& s = *state_;
  if (s.records.empty()) return;
  mcap::Chunk chunk;
  s.write(mcap::chunk_record(s.records, s.indexes, s.offset, chunk));
  s.write(mcap::index_records(s.indexes, chunk));
  s.summary.chunks.push_back(std::move(chunk));
  s.records.clear();
  s.indexes.clear();
}

void McapWriter::end() {
  State& s = *state_;
  WELDCELL_ASSERT(s.begun && !s.ended);
  flush();
  Bytes out;
  Put put(out);
  const std::size_t record = put.open(Op::DataEnd);
  put.u32(s.data_crc);
  put.close(record);
  s.write(out);
  s.write(mcap::tail(s.summary, s.offset));
  s.ended = true;
}

}  // namespace weldcell::wire
