#include "wire/mcap_reader.hpp"

#include <algorithm>

#include "wire/crc32.hpp"

namespace weldcell::wire::mcap {

void Reader::look_at_end() {
  limit_ = file_.size();
  if (file_.size() < kMagic.size() + kTailBytes) return;
  const std::size_t footer = file_.size() - kTailBytes;
  const bool has_footer = opcode(footer) == static_cast<std::uint8_t>(Op::Footer) && length(footer) == 20;
  const bool has_magic =
      std::equal(kMagic.begin(), kMagic.end(), file_.end() - static_cast<std::ptrdiff_t>(kMagic.size()));
  ended_ = has_footer || has_magic;
  out_.complete = ended_;
  if (!ended_) return;
  limit_ = footer;
  const std::uint64_t start = Get(file_.subspan(footer + kRecordHead, 8)).u64();
  if (start >= kMagic.size() + kDataEndBytes && start <= footer)
    summary_start_ = static_cast<std::size_t>(start);
}

/// A damaged chunk may hold the only other copy of a channel; the summary's is as good when its checksum
/// holds.
void Reader::learn_channels() {
  if (summary_start_ == 0) return;
  const std::size_t crc_at = limit_ + kFooterBytes - 4;
  if (Get(file_.subspan(crc_at, 4)).u32() != crc32(slice(summary_start_, crc_at))) return;
  for (std::size_t at = summary_start_; limit_ - at >= kRecordHead;) {
    const std::uint64_t size = length(at);
    if (size > limit_ - at - kRecordHead) return;
    Channel channel;
    const View content = file_.subspan(at + kRecordHead, static_cast<std::size_t>(size));
    if (opcode(at) == static_cast<std::uint8_t>(Op::Channel) && get_channel(content, channel)) {
      known_[channel.id] = channel;
    }
    at += kRecordHead + static_cast<std::size_t>(size);
  }
}

bool Reader::data_end_at(std::size_t at) const {
  const bool sound = opcode(at) == static_cast<std::uint8_t>(Op::DataEnd) && length(at) == 4 &&
                     file_.size() - at >= kDataEndBytes;
  return sound || (ended_ && at + kDataEndBytes == summary_start_);
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

/// Where the index records end that begin there, whatever they say.
std::size_t Reader::behind_indexes(std::size_t at) const {
  while (limit_ - at >= kRecordHead && opcode(at) == static_cast<std::uint8_t>(Op::MessageIndex) &&
         length(at) <= limit_ - at - kRecordHead) {
    at += kRecordHead + static_cast<std::size_t>(length(at));
  }
  return at;
}

void Reader::take_data_end(std::size_t at) {
  const std::size_t end = at + kDataEndBytes;
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
  const Bytes expected = tail(summary_, at);
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
  const std::size_t crc_at = limit_ + kFooterBytes - 4;
  const std::uint32_t crc = Get(file_.subspan(crc_at, 4)).u32();
  const std::size_t from = std::min(at, limit_);
  if (crc != 0 && summary_start_ != 0 && crc != crc32(slice(summary_start_, crc_at))) {
    damage("mcap.summary", from, limit_ + kFooterBytes, "the checksum of the summary does not fit");
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
  Attachment index;
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

}  // namespace weldcell::wire::mcap
