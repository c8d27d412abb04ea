#include "weldcell/adapters/systemd.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "weldcell/adapters/fd.hpp"
#include "weldcell/adapters/host_clock.hpp"

namespace weldcell::adapters {
namespace {

constexpr std::size_t kMostSecretBytes = 64 * 1024;

bool notify(const std::string& message) { return ::sd_notify(0, message.c_str()) > 0; }

/// A line end would begin another assignment of the notify protocol.
std::string status_line(std::string_view status) {
  std::string out = "STATUS=";
  for (const char c : status) out += c == '\n' || c == '\r' ? ' ' : c;
  return out;
}

Result<std::string> read_secret(const std::string& path, const char* absent_mend, bool check_mode) {
  const Fd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY));
  if (!fd.valid()) {
    const bool absent = errno == ENOENT || errno == ENOTDIR;
    return Error{absent ? "credential.absent" : "credential.unreadable", path, std::strerror(errno),
                 absent_mend};
  }
  struct stat facts {};
  ::fstat(fd.get(), &facts);
  if (!S_ISREG(facts.st_mode)) return Error{"credential.unreadable", path, "is no plain file", absent_mend};
  if (check_mode && (facts.st_mode & (S_IRWXO)) != 0)
    return Error{"credential.mode", path, "everybody may read this secret",
                 "chmod 0600 it (0640 for a group)"};
  std::string text;
  std::array<char, 4096> piece;
  for (ssize_t got; (got = ::read(fd.get(), piece.data(), piece.size())) != 0;) {
    if (got < 0 && errno == EINTR) continue;
    if (got < 0 || text.size() > kMostSecretBytes)
      return Error{"credential.unreadable", path, got < 0 ? std::strerror(errno) : "is larger than 64 kB",
                   absent_mend};
    text.append(piece.data(), static_cast<std::size_t>(got));
  }
  while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.pop_back();
  return text;
}

}  // namespace

bool notify_ready(std::string_view status) { return notify("READY=1\n" + status_line(status)); }
bool notify_status(std::string_view status) { return notify(status_line(status)); }
bool notify_watchdog() { return notify("WATCHDOG=1"); }
bool notify_stopping(std::string_view status) { return notify("STOPPING=1\n" + status_line(status)); }
bool notify_reloading() {
  return notify("RELOADING=1\nMONOTONIC_USEC=" + std::to_string(now().ns / kMicrosecond));
}

std::optional<Nanoseconds> watchdog_interval() {
  std::uint64_t microseconds = 0;
  if (::sd_watchdog_enabled(0, &microseconds) <= 0) return std::nullopt;
  return static_cast<Nanoseconds>(microseconds) * kMicrosecond;
}

Result<std::string> credential(std::string_view name) {
  if (name.empty() || name.front() == '.' || name.find('/') != std::string_view::npos)
    return Error{"credential.name", std::string(name), "is no plain file name",
                 "name it as in LoadCredential="};
  const char* folder = std::getenv("CREDENTIALS_DIRECTORY");
  if (folder == nullptr || *folder == '\0')
    return Error{"credential.absent", std::string(name), "the service manager passed no credentials",
                 "start through systemd with LoadCredential=, or name a password file in the cell file"};
  return read_secret(std::string(folder) + "/" + std::string(name), "add it with LoadCredential= to the unit",
                     false);
}

Result<std::string> secret_file(const std::string& path) {
  return read_secret(path, "check the path of the password file and its rights", true);
}

std::vector<ListenSocket> listen_sockets() {
  char** names = nullptr;
  const int count = ::sd_listen_fds_with_names(0, &names);
  std::vector<ListenSocket> out;
  for (int i = 0; i < count; ++i) {
    out.push_back({SD_LISTEN_FDS_START + i, names != nullptr && names[i] != nullptr ? names[i] : "unknown"});
    if (names != nullptr) std::free(names[i]);
  }
  std::free(names);
  return out;
}

}  // namespace weldcell::adapters
