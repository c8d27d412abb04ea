#include "sim/rws_socket.hpp"

#include <Poco/Exception.h>
#include <Poco/Net/NetException.h>
#include <Poco/Net/WebSocket.h>

#include <array>
#include <chrono>

namespace weldcell::sim {

namespace net = Poco::Net;
using net::WebSocket;

namespace {

constexpr int kPong = int{WebSocket::FRAME_FLAG_FIN} | int{WebSocket::FRAME_OP_PONG};
constexpr int kPing = int{WebSocket::FRAME_FLAG_FIN} | int{WebSocket::FRAME_OP_PING};
constexpr Poco::Timespan::TimeDiff kTick_us = 20'000;

/// Deals with one frame of the client; false when the connection is over.
bool take_frame(WebSocket& socket, int generation) {
  std::array<char, 4096> buffer;
  int flags = 0;
  const int size = socket.receiveFrame(buffer.data(), static_cast<int>(buffer.size()), flags);
  const int kind = flags & WebSocket::FRAME_OP_BITMASK;
  if (kind == WebSocket::FRAME_OP_CLOSE || (size == 0 && flags == 0)) return false;
  if (kind == WebSocket::FRAME_OP_PING) {
    // Generation 2 answers no ping.
    if (generation == 1) socket.sendFrame(buffer.data(), size, kPong);
    return true;
  }
  if (kind == WebSocket::FRAME_OP_PONG || generation == 1) return true;
  socket.shutdown(WebSocket::WS_POLICY_VIOLATION, "Client cannot send data");
  return false;
}

void serve(WebSocket& socket, const RwsSocketRules& rules) {
  using Clock = std::chrono::steady_clock;
  auto last_ping = Clock::now();
  while (!*rules.stopping) {
    std::vector<std::string> frames;
    if (!rules.next_frames(frames)) return;
    for (const std::string& frame : frames)
      socket.sendFrame(frame.data(), static_cast<int>(frame.size()), WebSocket::FRAME_TEXT);
    const double silent_s = std::chrono::duration<double>(Clock::now() - last_ping).count();
    if (rules.generation == 1 && silent_s >= rules.ping_interval_s) {
      last_ping = Clock::now();
      socket.sendFrame("", 0, kPing);
    }
    if (socket.available() > 0 || socket.poll(Poco::Timespan(kTick_us), net::Socket::SELECT_READ)) {
      if (!take_frame(socket, rules.generation)) return;
    }
  }
}

}  // namespace

void serve_rws_socket(net::HTTPServerRequest& request, net::HTTPServerResponse& response,
                      const RwsSocketRules& rules) {
  try {
    response.set("Sec-WebSocket-Protocol", request.get("Sec-WebSocket-Protocol", ""));
    WebSocket socket(request, response);
    socket.setReceiveTimeout(Poco::Timespan(2, 0));
    socket.setSendTimeout(Poco::Timespan(2, 0));
    serve(socket, rules);
  } catch (const Poco::Exception&) {
    // The client went away, or what it sent was no WebSocket.
  }
}

}  // namespace weldcell::sim
