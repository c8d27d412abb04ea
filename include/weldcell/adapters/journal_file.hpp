// An append-only file behind wire::McapWriter: buffered, never throws, says once when the disk fails. Owned
// by the journal thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "weldcell/adapters/fd.hpp"
#include "weldcell/base/result.hpp"

namespace weldcell::adapters {

class JournalFile {
 public:
  /// Makes a new file (mode 0640); an existing one is never overwritten. Errors: "journal.exists",
  /// "journal.open".
  static Result<std::unique_ptr<JournalFile>> create(const std::filesystem::path& path,
                                                     std::size_t buffer_bytes = 256 * 1024);
  ~JournalFile();
  JournalFile(const JournalFile&) = delete;
  JournalFile& operator=(const JournalFile&) = delete;

  /// Appends. After the first failure nothing more is written, so the file stays a readable prefix.
  void write(std::span<const std::byte> bytes) noexcept;
  /// Hands the buffer to the kernel; with `durable` it returns after the disk has it. False after a failure.
  bool flush(bool durable) noexcept;
  /// Durable flush, then closes; further calls do nothing. False after a failure.
  bool close() noexcept;

  /// The failure, the first time this is called after it: "journal.disk_full", "journal.write".
  std::optional<Error> take_fault();
  bool failed() const noexcept { return error_number_ != 0; }
  std::uint64_t bytes_written() const noexcept { return bytes_written_; }  ///< handed to the kernel
  const std::filesystem::path& path() const noexcept { return path_; }

 private:
  JournalFile() = default;
  void write_out(std::span<const std::byte> more) noexcept;

  Fd fd_;
  std::filesystem::path path_;
  std::vector<std::byte> buffer_;
  std::size_t filled_ = 0;
  std::uint64_t bytes_written_ = 0;
  int error_number_ = 0;
  bool fault_told_ = false;
};

}  // namespace weldcell::adapters
