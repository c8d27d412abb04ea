// RWS 1.0 over a socket: HTTP digest, session cookies, bounded rate. Owned by the rws thread; blocks for at
// most the timeout.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "weldcell/base/time.hpp"
#include "weldcell/ports/http.hpp"

namespace weldcell::adapters {

struct RwsAccess {
  std::string host = "127.0.0.1";
  int port = 80;
  std::string user = "Default User";
  std::string password;               ///< appears in no message of this adapter
  Nanoseconds timeout = 5 * kSecond;  ///< of connecting, and of each send and receive
  Nanoseconds least_interval =
      55 * kMillisecond;  ///< between starts of requests: the controller allows fewer than 20 a second
};

struct RwsHttpCounters {
  std::uint64_t requests = 0;    ///< on the wire, retries included
  std::uint64_t challenges = 0;  ///< 401 answered with fresh credentials
  std::uint64_t overloads = 0;   ///< 503
  std::uint64_t reconnects = 0;
};

/// Replies of any status but 401 are handed up as they are (503 included: too many sessions or requests). A
/// 401 is answered once with the server's new nonce; a second one is "http.refused". A kept connection that
/// the controller had closed meanwhile is opened again once, for GET only: a POST may have taken effect and
/// is never repeated.
class RwsHttp final : public ports::HttpTransport {
 public:
  explicit RwsHttp(RwsAccess access);
  /// Frees the session on the controller (GET /logout) when one stands.
  ~RwsHttp() override;
  RwsHttp(const RwsHttp&) = delete;
  RwsHttp& operator=(const RwsHttp&) = delete;

  Result<ports::HttpReply> exchange(const ports::HttpRequest& request) override;
  /// Ends the session; mastership held by it is dropped by the controller. The next exchange begins a new
  /// one.
  void logout();
  const RwsHttpCounters& counters() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace weldcell::adapters
