// The command line's way into the daemon: a unix socket, one JSON request a line, one JSON answer a line.
// Server: one thread.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "weldcell/base/result.hpp"
#include "weldcell/base/time.hpp"

namespace weldcell::adapters {

inline constexpr std::size_t kControlLineBytes = 64 * 1024;  ///< a longer request closes its connection
inline constexpr int kControlClients = 8;

struct ControlRequest {
  std::string command;  ///< "status", "arm", "start", "confirm", ...
  std::string json;     ///< the whole request, for further keys
  int peer_uid = -1;    ///< who asks, by the kernel
};

class ControlSocket {
 public:
  /// Returns the answer: one JSON object. Line ends inside are turned to blanks.
  using Handler = std::function<std::string(const ControlRequest&)>;

  /// Listens at `path` (mode 0660). A stale socket file is replaced; one that a living daemon answers is
  /// "control.in_use". Other errors: "control.path" (longer than 107 bytes, no folder), "control.bind".
  static Result<ControlSocket> listen(const std::filesystem::path& path, Handler handler);
  ControlSocket(ControlSocket&&) noexcept;
  ControlSocket& operator=(ControlSocket&&) noexcept;
  ~ControlSocket();

  /// One step: waits at most `timeout`, then answers every whole line that is there. Lines that are no JSON
  /// object with a string "command" are answered {"ok":false,"error":...} without asking the handler.
  void poll(Nanoseconds timeout);
  int clients() const;

 private:
  struct State;
  explicit ControlSocket(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Sends one line and returns the answer without its line end. Errors: "control.no_daemon" (nothing listens),
/// "control.permission", "control.timeout", "control.closed".
Result<std::string> control_request(const std::filesystem::path& path, std::string_view json_line,
                                    Nanoseconds timeout);

}  // namespace weldcell::adapters
