#include "weldcell/adapters/journal_file.hpp"

#include <fcntl.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

namespace weldcell::adapters {

Result<std::unique_ptr<JournalFile>> JournalFile::create(const std::filesystem::path& path,
                                                         std::size_t buffer_bytes) {
  std::unique_ptr<JournalFile> out(new JournalFile);
  out->path_ = path;
  out->fd_ = Fd(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC | O_NOFOLLOW, 0640));
  if (!out->fd_.valid()) {
    const int reason = errno;
    if (reason == EEXIST)
      return Error{"journal.exists", path.string(), "a record of this name exists already",
                   "move it away; records are never overwritten"};
    return Error{"journal.open", path.string(), std::strerror(reason),
                 "check that the folder exists and may be written"};
  }
  out->buffer_.resize(std::max<std::size_t>(buffer_bytes, 1));
  return out;
}

JournalFile::~JournalFile() { close(); }

void JournalFile::write(std::span<const std::byte> bytes) noexcept {
  if (failed() || !fd_.valid()) return;
  if (bytes.size() > buffer_.size() - filled_) {
    write_out(bytes);
    return;
  }
  std::ranges::copy(bytes, buffer_.begin() + static_cast<std::ptrdiff_t>(filled_));
  filled_ += bytes.size();
}

void JournalFile::write_out(std::span<const std::byte> more) noexcept {
  std::array<iovec, 2> pieces{iovec{buffer_.data(), filled_},
                              iovec{const_cast<std::byte*>(more.data()), more.size()}};
  std::size_t first = 0;
  while (first < pieces.size()) {
    if (pieces[first].iov_len == 0) {
      ++first;
      continue;
    }
    const ssize_t written =
        ::writev(fd_.get(), pieces.data() + first, static_cast<int>(pieces.size() - first));
    if (written < 0) {
      if (errno == EINTR) continue;
      error_number_ = errno;
      break;
    }
    bytes_written_ += static_cast<std::uint64_t>(written);
    auto left = static_cast<std::size_t>(written);
    for (iovec& piece : pieces) {
      const std::size_t part = std::min(left, piece.iov_len);
      piece.iov_base = static_cast<std::byte*>(piece.iov_base) + part;
      piece.iov_len -= part;
      left -= part;
    }
  }
  filled_ = 0;
}

bool JournalFile::flush(bool durable) noexcept {
  if (!fd_.valid()) return !failed();
  if (!failed() && filled_ != 0) write_out({});
  if (!failed() && durable && ::fdatasync(fd_.get()) != 0) error_number_ = errno;
  return !failed();
}

bool JournalFile::close() noexcept {
  const bool whole = flush(true);
  fd_.reset();
  return whole;
}

std::optional<Error> JournalFile::take_fault() {
  if (!failed() || fault_told_) return std::nullopt;
  fault_told_ = true;
  const bool full = error_number_ == ENOSPC || error_number_ == EDQUOT || error_number_ == EFBIG;
  return Error{full ? "journal.disk_full" : "journal.write", path_.string(),
               std::string(std::strerror(error_number_)) + " after " + std::to_string(bytes_written_) +
                   " bytes; the record ends there",
               full ? "free space on this disk; the job can be run, but not replayed" : "check the disk"};
}

}  // namespace weldcell::adapters
