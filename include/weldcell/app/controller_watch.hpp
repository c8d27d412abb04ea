// What the robot controller is doing, by subscription: controller state, operation mode, execution and event
// log, with slow polling beside it as liveness check and fallback. Owned by the rws thread.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "weldcell/adapters/rws_client.hpp"
#include "weldcell/adapters/rws_http.hpp"
#include "weldcell/adapters/rws_socket.hpp"

namespace weldcell::app {

/// The newest that was heard.
struct ControllerView {
  bool reachable = false;  ///< the last question was answered
  bool live = false;       ///< a subscription stands: changes come by themselves
  adapters::ControllerState controller = adapters::ControllerState::Unknown;
  adapters::OperationMode mode = adapters::OperationMode::Unknown;
  adapters::ExecutionState execution = adapters::ExecutionState::Unknown;
  std::string detail;  ///< the controller state in words, or why it cannot be reached
};

struct ControllerWatchOptions {
  Nanoseconds look = 2 * kSecond;  ///< between two questions whether it is still there
  Nanoseconds full_look =
      10 * kSecond;                   ///< between two questions for everything while the subscription stands
  Nanoseconds first_retry = kSecond;  ///< after a subscription was lost or refused; doubles up to
  Nanoseconds last_retry = 30 * kSecond;
};

class ControllerWatch {
 public:
  ControllerWatch(adapters::RwsClient& client, adapters::RwsHttp& http, ControllerWatchOptions options = {})
      : client_(&client), http_(&http), options_(options) {}

  /// Takes what came; at most a few exchanges. A subscription that ended (restart, lost link, refused) is
  /// made anew.
  void step(HostTime now);
  const ControllerView& view() const { return view_; }
  /// Entries of the event log since the last call, oldest first; only while a subscription stands.
  std::vector<adapters::ControllerEvent> take_events();
  /// Subscriptions made so far.
  int subscriptions() const { return subscriptions_; }

 private:
  void receive();
  void subscribe(HostTime now);
  void lose(const std::string& why, HostTime now);
  void look(HostTime now);

  adapters::RwsClient* client_;
  adapters::RwsHttp* http_;
  ControllerWatchOptions options_;
  ControllerView view_;
  std::optional<adapters::RwsSocket> socket_;
  std::string lost_;  ///< why receive() found the socket closed
  std::string group_;
  HostTime next_look_, next_full_look_, next_try_;
  Nanoseconds retry_ = 0;
  int subscriptions_ = 0;
  std::vector<adapters::ControllerEvent> events_;
};

}  // namespace weldcell::app
