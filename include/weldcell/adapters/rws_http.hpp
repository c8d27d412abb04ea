// RWS over a socket: HTTP digest in generation 1, TLS with a pinned certificate and HTTP basic in generation
// 2, session cookies, bounded rate. Owned by the rws thread; blocks for at most the timeout.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "weldcell/base/time.hpp"
#include "weldcell/ports/http.hpp"
#include "weldcell/wire/rws_requests.hpp"

namespace weldcell::adapters {

struct RwsAccess {
  std::string host = "127.0.0.1";
  int port = 80;
  wire::RwsGeneration generation = wire::RwsGeneration::One;
  std::string
      certificate_sha256;  ///< generation 2: 64 lower-case hexadecimal digits; nothing is sent to another
  std::string user = "Default User";
  std::string password;  ///< appears in no message of this adapter
  /// Where the session's cookies lie from its login to its logout, so that a killed process's session can be
  /// ended by the next one; "" = nowhere. They are secrets: mode 0600, in no message.
  std::string session_file;
  Nanoseconds timeout = 5 * kSecond;  ///< of connecting, and of each send and receive
  /// Between starts of requests, and how many may start at once: the controller allows fewer than 20 a
  /// second.
  Nanoseconds least_interval = kSecond / 16;
  int burst = 2;
  int overload_retries = 2;                         ///< after a 503, which did nothing
  Nanoseconds overload_pause = 500 * kMillisecond;  ///< before each of them
};

struct RwsHttpCounters {
  std::uint64_t requests = 0;    ///< on the wire, retries included
  std::uint64_t challenges = 0;  ///< 401 answered with fresh credentials
  std::uint64_t overloads = 0;   ///< 503
  std::uint64_t reconnects = 0;
};

/// Replies of any status but 401 are handed up as they are (503 after the retries: too many sessions or
/// requests). A 401 is answered once with the server's new nonce; a second one is "http.refused". A kept
/// connection that the controller had closed meanwhile is opened again once, for GET only: a POST may have
/// taken effect and is never repeated. "http.certificate": the controller shows another certificate than the
/// pinned one; neither request nor credentials were sent.
class RwsHttp final : public ports::HttpTransport {
 public:
  explicit RwsHttp(RwsAccess access);
  /// Frees the session on the controller (GET /logout) when one stands.
  ~RwsHttp() override;
  RwsHttp(const RwsHttp&) = delete;
  RwsHttp& operator=(const RwsHttp&) = delete;

  Result<ports::HttpReply> exchange(const ports::HttpRequest& request) override;
  /// An earlier process left its session: the cookies of session_file are in use until logout().
  bool has_former_session() const;
  /// Ends the session; mastership held by it is dropped by the controller. The next exchange begins a new
  /// one. Errors as exchange(), and "http.overloaded" (503): the session may stand still, and its file stays.
  Status logout();
  /// Why the session's cookies could not be kept, once each time that it begins.
  std::optional<Error> take_session_fault();
  const RwsHttpCounters& counters() const;
  const RwsAccess& access() const;
  /// The session's cookies as a Cookie header, "" before the first exchange.
  std::string cookie_header() const;
  /// Waits until one more request may start, and counts it: for what goes to the controller past exchange().
  void take_turn();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Which generation answers there: TLS is 2, a digest challenge over plain HTTP is 1. Sends no credentials.
/// Errors: "http.unreachable", "http.refused" (something else answers).
Result<wire::RwsGeneration> find_rws_generation(const RwsAccess& access);

}  // namespace weldcell::adapters
