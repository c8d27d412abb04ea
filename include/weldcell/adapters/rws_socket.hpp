// The WebSocket of an RWS subscription: event frames in, nothing but answers to pings out. Owned by the rws
// thread.
#pragma once

#include <memory>
#include <string>

#include "weldcell/adapters/rws_http.hpp"

namespace weldcell::adapters {

class RwsSocket {
 public:
  /// Shakes hands with the session's cookies; `poll` is the path that the subscription's creation named.
  /// Errors "http.*" as the carrier's, "rws.socket" when the controller refuses (spent path, unknown
  /// session).
  static Result<RwsSocket> open(const RwsAccess& access, const std::string& poll, const std::string& cookies);
  RwsSocket(RwsSocket&&) noexcept;
  RwsSocket& operator=(RwsSocket&&) noexcept;
  ~RwsSocket();

  enum class Event { Nothing, Frame, Closed };
  /// The next frame when one is there or comes within `wait`. Generation 1 is closed after 40 s without a
  /// frame or a ping (it pings every 30 s); generation 2 may be silent for ever: ask it something now and
  /// then.
  Event receive(std::string& frame, Nanoseconds wait);
  /// Why it is closed.
  const std::string& reason() const;

 private:
  struct State;
  explicit RwsSocket(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace weldcell::adapters
