// The WebSocket of one subscription: event frames out, and what the controllers do with what clients send.
#pragma once

#include <Poco/Net/HTTPServerRequest.h>
#include <Poco/Net/HTTPServerResponse.h>

#include <atomic>
#include <functional>
#include <string>
#include <vector>

namespace weldcell::sim {

struct RwsSocketRules {
  int generation = 1;
  double ping_interval_s = 30;
  /// Frames that are due; false when the subscription is over.
  std::function<bool(std::vector<std::string>&)> next_frames;
  const std::atomic<bool>* stopping = nullptr;
};

/// Shakes hands and serves until the client, the subscription or the server ends. Blocks.
void serve_rws_socket(Poco::Net::HTTPServerRequest& request, Poco::Net::HTTPServerResponse& response,
                      const RwsSocketRules& rules);

}  // namespace weldcell::sim
