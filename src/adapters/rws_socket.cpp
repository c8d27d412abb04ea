#include "weldcell/adapters/rws_socket.hpp"

#include <Poco/Net/HTTPBasicCredentials.h>
#include <Poco/Net/HTTPCredentials.h>
#include <Poco/Net/HTTPRequest.h>
#include <Poco/Net/HTTPResponse.h>
#include <Poco/Net/NetException.h>
#include <Poco/Net/WebSocket.h>

#include <array>

#include "rws_session.hpp"
#include "weldcell/adapters/host_clock.hpp"

namespace weldcell::adapters {

namespace net = Poco::Net;
using net::WebSocket;
using wire::RwsGeneration;

namespace {

constexpr Nanoseconds kLongestSilence = 40 * kSecond;
constexpr int kMostFrameBytes = 1 << 20;
constexpr int kPong = int{WebSocket::FRAME_FLAG_FIN} | int{WebSocket::FRAME_OP_PONG};

}  // namespace

struct RwsSocket::State {
  WebSocket socket;
  RwsGeneration generation;
  HostTime heard;
  std::string reason;
  std::string message;  ///< pieces of a text that came in several frames
};

RwsSocket::RwsSocket(std::unique_ptr<State> state) : state_(std::move(state)) {}
RwsSocket::RwsSocket(RwsSocket&&) noexcept = default;
RwsSocket& RwsSocket::operator=(RwsSocket&&) noexcept = default;
RwsSocket::~RwsSocket() = default;
const std::string& RwsSocket::reason() const { return state_->reason; }

Result<RwsSocket> RwsSocket::open(const RwsAccess& access, const std::string& poll,
                                  const std::string& cookies) {
  const std::string place = "rws " + access.host + ":" + std::to_string(access.port) + poll;
  const bool two = access.generation == RwsGeneration::Two;
  net::HTTPResponse response;
  try {
    const auto session = make_rws_session(access);
    net::HTTPRequest request(net::HTTPRequest::HTTP_GET, poll, net::HTTPRequest::HTTP_1_1);
    request.set("Sec-WebSocket-Protocol", wire::RwsDialect(access.generation).websocket_protocol());
    if (!cookies.empty()) request.set("Cookie", cookies);
    net::HTTPCredentials digest(access.user, access.password);
    if (two) net::HTTPBasicCredentials(access.user, access.password).authenticate(request);
    WebSocket socket =
        two ? WebSocket(*session, request, response) : WebSocket(*session, request, response, digest);
    const Poco::Timespan timeout = rws_timespan(access.timeout);
    socket.setReceiveTimeout(timeout);
    socket.setSendTimeout(timeout);
    socket.setMaxPayloadSize(kMostFrameBytes);
    return RwsSocket(std::make_unique<State>(State{std::move(socket), access.generation, now(), "", ""}));
  } catch (const WrongCertificate& e) {
    return Error{"http.certificate", place, e.message(), "check rws.certificate_sha256 at the controller"};
  } catch (const net::WebSocketException&) {
    return Error{"rws.socket", place,
                 "the controller refuses the WebSocket (HTTP " + std::to_string(response.getStatus()) + ")",
                 "the subscription is made anew"};
  } catch (const Poco::TimeoutException&) {
    return Error{"http.timeout", place, "no answer to the WebSocket's handshake",
                 "check controller and network"};
  } catch (const Poco::Exception& e) {
    return Error{"http.unreachable", place, e.displayText(), "check that the controller runs"};
  }
}

RwsSocket::Event RwsSocket::receive(std::string& frame, Nanoseconds wait) {
  State& s = *state_;
  const auto closed = [&s](std::string why) {
    s.reason = std::move(why);
    return Event::Closed;
  };
  if (!s.reason.empty()) return Event::Closed;
  try {
    if (s.socket.available() <= 0 && !s.socket.poll(rws_timespan(wait), net::Socket::SELECT_READ)) {
      if (s.generation == RwsGeneration::One && now() - s.heard > kLongestSilence)
        return closed("no ping for 40 s");
      return Event::Nothing;
    }
    Poco::Buffer<char> buffer(0);
    int flags = 0;
    const int size = s.socket.receiveFrame(buffer, flags);
    s.heard = now();
    const int kind = flags & WebSocket::FRAME_OP_BITMASK;
    if (kind == WebSocket::FRAME_OP_CLOSE || (size == 0 && flags == 0))
      return closed("the controller closed the subscription");
    if (kind == WebSocket::FRAME_OP_PING) {
      s.socket.sendFrame(buffer.begin(), size, kPong);
      return Event::Nothing;
    }
    if (kind == WebSocket::FRAME_OP_PONG) return Event::Nothing;
    s.message.append(buffer.begin(), static_cast<std::size_t>(size));
    if (s.message.size() > kMostFrameBytes) return closed("an event larger than 1 MB");
    if ((flags & WebSocket::FRAME_FLAG_FIN) == 0) return Event::Nothing;
    frame = std::exchange(s.message, {});
    return Event::Frame;
  } catch (const Poco::Exception& e) {
    return closed("the subscription's connection is lost: " + e.displayText());
  }
}

}  // namespace weldcell::adapters
