// What systemd gives and wants: readiness, status, watchdog, credentials, sockets. Main thread; quiet where
// there is no systemd.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "weldcell/base/result.hpp"
#include "weldcell/base/time.hpp"

namespace weldcell::adapters {

/// All return true when a supervisor took the message, false when there is none.
bool notify_ready(std::string_view status);
bool notify_status(std::string_view status);
bool notify_watchdog();
bool notify_stopping(std::string_view status);
bool notify_reloading();

/// Time within which notify_watchdog() must come; ping at half of it. Empty: no watchdog for this process.
std::optional<Nanoseconds> watchdog_interval();

/// The credential's text without a trailing line end. Errors: "credential.absent" (none of that name, or no
/// CREDENTIALS_DIRECTORY), "credential.name" (not a plain file name), "credential.unreadable".
Result<std::string> credential(std::string_view name);
/// The same from a file; refused with "credential.mode" when others may read it.
Result<std::string> secret_file(const std::string& path);

struct ListenSocket {
  int fd = -1;
  std::string name;  ///< FileDescriptorName=, "unknown" without
};
/// Listening sockets that systemd passed to this process; the caller owns them.
std::vector<ListenSocket> listen_sockets();

}  // namespace weldcell::adapters
