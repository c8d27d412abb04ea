// MCAP records <-> bytes: a writer that appends to a byte sink and a reader that survives a missing footer.
// Pure.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "weldcell/base/result.hpp"
#include "weldcell/base/time.hpp"

namespace weldcell::wire {

using Bytes = std::vector<std::byte>;

/// Writes one MCAP file through a sink. Chunked (uncompressed, CRC-32), with summary, statistics and
/// attachments. Nothing is buffered beyond one chunk; a file cut anywhere still reads up to its last whole
/// record.
class McapWriter {
 public:
  using Sink = std::function<void(std::span<const std::byte>)>;
  explicit McapWriter(Sink sink, std::size_t chunk_bytes = 64 * 1024);
  ~McapWriter();

  void begin(std::string_view profile, std::string_view library);
  /// Channel with a schema of that name; encoding e.g. "json" or "application/octet-stream". Returns the
  /// channel's id.
  std::uint16_t channel(std::string_view topic, std::string_view encoding, std::string_view schema_name = {},
                        std::string_view schema_encoding = {}, std::string_view schema = {});
  void message(std::uint16_t channel, std::uint32_t sequence, HostTime log_time,
               std::span<const std::byte> data);
  void attachment(std::string_view name, std::string_view media_type, HostTime log_time,
                  std::string_view text);
  /// Closes the chunk at hand, so that what was written so far survives a crash.
  void flush();
  /// Chunk, data end, summary, footer and magic. No call may follow.
  void end();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

struct McapMessage {
  std::string topic;
  std::uint32_t sequence = 0;
  HostTime log_time;
  Bytes data;
  std::uint64_t file_offset = 0;  ///< of the message's record, from the start of the file
};

struct McapAttachment {
  std::string name, media_type, text;
};

struct McapFile {
  std::string profile, library;       ///< as given to begin()
  std::vector<McapMessage> messages;  ///< in file order
  std::vector<McapAttachment> attachments;
  bool complete = false;  ///< footer and end are there; false after a crash, which is no damage
  /// Every fault of a checksum, of framing or of a field that repeats what the data say. `where` is "bytes
  /// A-B", B not included, or "bytes A-B or C-D" when the fault is in one of two places.
  std::vector<Error> damage;
};

/// Reads a whole file, uncompressed chunks only. Damaged chunks and attachments are reported in `damage` and
/// skipped. In a complete file of McapWriter any changed byte is reported; in one without its end, any but
/// those of the header's texts and of a chunk cut short. Error "mcap.magic" when it is no MCAP at all.
Result<McapFile> read_mcap(std::span<const std::byte> file);

}  // namespace weldcell::wire
