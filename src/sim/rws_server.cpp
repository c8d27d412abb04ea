#include "sim/rws_server.hpp"

#include <Poco/Net/HTTPRequestHandler.h>
#include <Poco/Net/HTTPRequestHandlerFactory.h>
#include <Poco/Net/HTTPServer.h>
#include <Poco/Net/HTTPServerRequest.h>
#include <Poco/Net/HTTPServerResponse.h>
#include <Poco/Net/ServerSocket.h>

#include <chrono>

#include "sim/rws_sessions.hpp"

namespace weldcell::sim {

namespace net = Poco::Net;

namespace {
constexpr std::size_t kMaxBody = 8'000'000;
}

/// What all request threads share.
struct RwsServer::Shared {
  Controller& controller;
  std::mutex& lock;
  RwsSessions sessions;
  std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();

  double now_s() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
};

namespace {

class Handler final : public net::HTTPRequestHandler {
 public:
  explicit Handler(RwsServer::Shared& shared) : shared_(shared) {}

  void handleRequest(net::HTTPServerRequest& request, net::HTTPServerResponse& response) override {
    std::string body;
    char buffer[8192];
    while (request.stream().read(buffer, sizeof buffer), request.stream().gcount() > 0) {
      body.append(buffer, static_cast<std::size_t>(request.stream().gcount()));
      if (body.size() > kMaxBody) {
        response.setStatus(net::HTTPResponse::HTTP_REQUEST_ENTITY_TOO_LARGE);
        response.setKeepAlive(false);
        response.send();
        return;
      }
    }
    const ports::HttpReply reply = answer(request, response, body);
    response.setStatus(static_cast<net::HTTPResponse::HTTPStatus>(reply.status));
    response.setReason(net::HTTPResponse::getReasonForStatus(response.getStatus()));
    for (const auto& [name, value] : reply.headers) response.set(name, value);
    if (reply.status == 204) {
      response.send();
      return;
    }
    response.setContentLength64(static_cast<Poco::Int64>(reply.body.size()));
    response.send() << reply.body;
  }

 private:
  ports::HttpReply answer(const net::HTTPServerRequest& request, net::HTTPServerResponse& response,
                          const std::string& body) {
    const std::lock_guard<std::mutex> hold(shared_.lock);
    const RwsAccess access =
        shared_.sessions.admit(request.getMethod(), request.getURI(), request.get("Authorization", ""),
                               request.get("Cookie", ""), shared_.now_s());
    for (const int gone : shared_.sessions.take_expired()) shared_.controller.end_rws_session(gone);
    ports::HttpReply reply;
    if (access.verdict == RwsAccess::Verdict::Challenge) {
      reply.status = 401;
      reply.headers["WWW-Authenticate"] = access.challenge;
      return reply;
    }
    if (access.verdict == RwsAccess::Verdict::Full) {
      reply.status = 503;
      reply.body = "Service Unavailable: too many sessions";
      return reply;
    }
    for (const std::string& cookie : access.set_cookies) response.add("Set-Cookie", cookie);
    if (request.getURI() == "/logout") {
      shared_.sessions.log_out(access.session);
      shared_.controller.end_rws_session(access.session);
      reply.status = 200;
      return reply;
    }
    ports::HttpRequest ask;
    ask.method = request.getMethod();
    ask.path = request.getURI();
    ask.body = body;
    ask.content_type = request.getContentType();
    return shared_.controller.handle_rws(ask, access.session);
  }

  RwsServer::Shared& shared_;
};

class Factory final : public net::HTTPRequestHandlerFactory {
 public:
  explicit Factory(RwsServer::Shared& shared) : shared_(shared) {}
  net::HTTPRequestHandler* createRequestHandler(const net::HTTPServerRequest&) override {
    return new Handler(shared_);
  }

 private:
  RwsServer::Shared& shared_;
};

net::HTTPServerParams::Ptr parameters() {
  net::HTTPServerParams::Ptr out = new net::HTTPServerParams;
  out->setMaxThreads(8);
  out->setMaxQueued(64);
  out->setKeepAlive(true);
  out->setKeepAliveTimeout(Poco::Timespan(30, 0));
  return out;
}

}  // namespace

struct RwsServer::State {
  State(const files::Endpoint& endpoint, const std::string& user, const std::string& password,
        std::uint64_t seed, Controller& controller, std::mutex& lock)
      : shared{controller, lock, RwsSessions(user, password, seed)},
        socket(net::SocketAddress(endpoint.host, static_cast<Poco::UInt16>(endpoint.port))),
        server(new Factory(shared), socket, parameters()) {
    server.start();
  }
  ~State() { server.stopAll(true); }

  Shared shared;
  net::ServerSocket socket;
  net::HTTPServer server;
};

RwsServer::RwsServer(const files::Endpoint& endpoint, const std::string& user, const std::string& password,
                     std::uint64_t seed, Controller& controller, std::mutex& lock)
    : state_(std::make_unique<State>(endpoint, user, password, seed, controller, lock)) {}
RwsServer::~RwsServer() = default;
int RwsServer::port() const { return state_->socket.address().port(); }
std::size_t RwsServer::sessions() const {
  const std::lock_guard<std::mutex> hold(state_->shared.lock);
  return state_->shared.sessions.count();
}

}  // namespace weldcell::sim
