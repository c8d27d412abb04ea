#include "sim/rws_server.hpp"

#include <Poco/Net/Context.h>
#include <Poco/Net/HTTPRequestHandler.h>
#include <Poco/Net/HTTPRequestHandlerFactory.h>
#include <Poco/Net/HTTPServer.h>
#include <Poco/Net/HTTPServerRequestImpl.h>
#include <Poco/Net/HTTPServerResponse.h>
#include <Poco/Net/SecureServerSocket.h>
#include <Poco/Net/ServerSocket.h>

#include <atomic>
#include <chrono>
#include <optional>

#include "sim/rws_handler.hpp"
#include "sim/rws_sessions.hpp"
#include "sim/rws_socket.hpp"
#include "sim/rws_subscriptions.hpp"

namespace weldcell::sim {

namespace net = Poco::Net;

namespace {
constexpr std::size_t kMaxBody = 8'000'000;
}

/// What all request threads share.
struct RwsServer::Shared {
  Shared(const RwsServerOptions& options, Controller& c, std::mutex& l)
      : controller(c),
        lock(l),
        generation(c.rws_generation()),
        ping_interval_s(options.ping_interval_s),
        sessions(options.user, options.password, options.seed, generation),
        subscriptions(generation),
        load(options.requests_per_s) {}

  Controller& controller;
  std::mutex& lock;
  const int generation;
  const double ping_interval_s;
  RwsSessions sessions;
  RwsSubscriptions subscriptions;
  RwsLoad load;
  std::uint64_t restarts_seen = 0;
  std::atomic<bool> stopping{false};
  std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();

  double now_s() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  RwsSubscriptions::Observe observe() {
    return [this](const std::string& uri) { return controller.observe_rws(uri); };
  }
  /// False while a restart is under way or the network is gone; after a restart nothing of before is known.
  /// Under the lock.
  bool awake() {
    if (controller.restarts() != restarts_seen) {
      restarts_seen = controller.restarts();
      sessions.forget_all();
      subscriptions.forget_all();
    }
    return !controller.rws_silent();
  }
};

namespace {

ports::HttpReply bare(int status, const std::string& body = "") {
  ports::HttpReply reply;
  reply.status = status;
  reply.body = body;
  return reply;
}

class Handler final : public net::HTTPRequestHandler {
 public:
  explicit Handler(RwsServer::Shared& shared) : shared_(shared) {}

  void handleRequest(net::HTTPServerRequest& request, net::HTTPServerResponse& response) override {
    std::string body;
    char buffer[8192];
    while (request.stream().read(buffer, sizeof buffer), request.stream().gcount() > 0) {
      body.append(buffer, static_cast<std::size_t>(request.stream().gcount()));
      if (body.size() > kMaxBody) return send(response, bare(413));
    }
    std::string poll;
    const auto reply = answer(request, response, body, poll);
    if (!reply) {
      // Nobody is there: the connection ends without a word.
      static_cast<net::HTTPServerRequestImpl&>(request).socket().shutdown();
      response.setKeepAlive(false);
      return;
    }
    if (reply->status == 101) return serve(request, response, poll);
    send(response, *reply);
  }

 private:
  static void send(net::HTTPServerResponse& response, const ports::HttpReply& reply) {
    response.setStatus(static_cast<net::HTTPResponse::HTTPStatus>(reply.status));
    response.setReason(net::HTTPResponse::getReasonForStatus(response.getStatus()));
    for (const auto& [name, value] : reply.headers) response.set(name, value);
    if (reply.status == 413) response.setKeepAlive(false);
    if (reply.status == 204) {
      response.send();
      return;
    }
    response.setContentLength64(static_cast<Poco::Int64>(reply.body.size()));
    response.send() << reply.body;
  }

  /// Empty: the controller is away. Status 101: a WebSocket is granted for `poll`.
  std::optional<ports::HttpReply> answer(const net::HTTPServerRequest& request,
                                         net::HTTPServerResponse& response, const std::string& body,
                                         std::string& poll) {
    const std::lock_guard<std::mutex> hold(shared_.lock);
    if (!shared_.awake()) return std::nullopt;
    const double now_s = shared_.now_s();
    if (!shared_.load.admit(now_s)) return bare(503, "Service Unavailable: too many requests");
    const RwsAccess access =
        shared_.sessions.admit(request.getMethod(), request.getURI(), request.get("Authorization", ""),
                               request.get("Cookie", ""), now_s);
    for (const int gone : shared_.sessions.take_expired()) end_session(gone);
    if (access.verdict == RwsAccess::Verdict::Challenge) {
      ports::HttpReply reply = bare(401);
      reply.headers["WWW-Authenticate"] = access.challenge;
      return reply;
    }
    if (access.verdict == RwsAccess::Verdict::Full)
      return bare(503, "Service Unavailable: too many sessions");
    for (const std::string& cookie : access.set_cookies) response.add("Set-Cookie", cookie);
    if (request.getURI() == "/logout") {
      shared_.sessions.log_out(access.session);
      end_session(access.session);
      return bare(200);
    }
    if (request.getURI().rfind("/poll/", 0) == 0) {
      poll = request.getURI().substr(6);
      return upgrade(request, poll, access.session);
    }
    const ports::HttpRequest ask{request.getMethod(), request.getURI(), body, request.getContentType(),
                                 request.get("Accept", "")};
    if (request.getURI().rfind("/subscription", 0) == 0) {
      if (shared_.generation == 2 && request.getContentType().find(";v=2.") == std::string::npos)
        return bare(415);
      return shared_.subscriptions.handle(ask, access.session, request.getHost(), shared_.observe(), now_s);
    }
    return shared_.controller.handle_rws(ask, access.session);
  }

  ports::HttpReply upgrade(const net::HTTPServerRequest& request, const std::string& poll, int session) {
    const char* const protocol = shared_.generation == 2 ? "rws_subscription" : "robapi2_subscription";
    if (Poco::icompare(request.get("Upgrade", ""), "websocket") != 0 ||
        request.get("Sec-WebSocket-Protocol", "") != protocol)
      return bare(400);
    switch (shared_.subscriptions.open(poll, session)) {
      case RwsSubscriptions::Open::Granted:
        return bare(101);
      case RwsSubscriptions::Open::Forbidden:
        return bare(403);
      case RwsSubscriptions::Open::NotFound:
        break;
    }
    return bare(404);
  }

  void serve(net::HTTPServerRequest& request, net::HTTPServerResponse& response, const std::string& poll) {
    RwsSocketRules rules;
    rules.generation = shared_.generation;
    rules.ping_interval_s = shared_.ping_interval_s;
    rules.stopping = &shared_.stopping;
    rules.next_frames = [this, &poll](std::vector<std::string>& frames) {
      const std::lock_guard<std::mutex> hold(shared_.lock);
      if (!shared_.awake() || !shared_.subscriptions.exists(poll)) return false;
      frames = shared_.subscriptions.frames(poll, shared_.observe(), shared_.now_s());
      return true;
    };
    serve_rws_socket(request, response, rules);
    const std::lock_guard<std::mutex> hold(shared_.lock);
    shared_.subscriptions.closed(poll);
  }

  void end_session(int session) {
    shared_.controller.end_rws_session(session);
    shared_.subscriptions.end_session(session);
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
  // A subscription keeps its thread as long as its WebSocket is open.
  out->setMaxThreads(24);
  out->setMaxQueued(64);
  out->setKeepAlive(true);
  out->setKeepAliveTimeout(Poco::Timespan(30, 0));
  return out;
}

net::ServerSocket listener(const files::Endpoint& endpoint, const TlsIdentity* identity) {
  const net::SocketAddress address(endpoint.host, static_cast<Poco::UInt16>(endpoint.port));
  if (identity == nullptr) return net::ServerSocket(address);
  net::Context::Params params;
  params.verificationMode = net::Context::VERIFY_NONE;
  net::Context::Ptr context = new net::Context(net::Context::TLS_SERVER_USE, params);
  context->requireMinimumProtocol(net::Context::PROTO_TLSV1_2);
  if (!identity->install(context->sslContext())) throw Poco::IOException("the TLS certificate is refused");
  return net::SecureServerSocket(address, 64, context);
}

}  // namespace

struct RwsServer::State {
  State(RwsServerOptions o, Controller& controller, std::mutex& lock)
      : options(std::move(o)),
        shared(options, controller, lock),
        pool("rws", 2, 32),
        socket(listener(options.endpoint, identity())),
        server(new Factory(shared), pool, socket, parameters()) {
    server.start();
  }
  ~State() {
    shared.stopping = true;
    server.stopAll(true);
    pool.joinAll();
  }
  const TlsIdentity* identity() {
    if (shared.generation != 2) return nullptr;
    if (!options.identity) options.identity = TlsIdentity::make();
    return &*options.identity;
  }

  RwsServerOptions options;
  Shared shared;
  Poco::ThreadPool pool;
  net::ServerSocket socket;
  net::HTTPServer server;
};

RwsServer::RwsServer(RwsServerOptions options, Controller& controller, std::mutex& lock)
    : state_(std::make_unique<State>(std::move(options), controller, lock)) {}
RwsServer::~RwsServer() = default;
int RwsServer::port() const { return state_->socket.address().port(); }
RwsLoad RwsServer::load() const {
  const std::lock_guard<std::mutex> hold(state_->shared.lock);
  return state_->shared.load;
}
std::size_t RwsServer::sessions() const {
  const std::lock_guard<std::mutex> hold(state_->shared.lock);
  return state_->shared.sessions.count();
}
std::size_t RwsServer::subscriptions() const {
  const std::lock_guard<std::mutex> hold(state_->shared.lock);
  return state_->shared.subscriptions.count();
}
std::string RwsServer::fingerprint() const {
  return state_->options.identity && state_->shared.generation == 2 ? state_->options.identity->fingerprint()
                                                                    : "";
}

}  // namespace weldcell::sim
