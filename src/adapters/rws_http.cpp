#include "weldcell/adapters/rws_http.hpp"

#include <Poco/Exception.h>
#include <Poco/Net/HTTPAuthenticationParams.h>
#include <Poco/Net/HTTPBasicCredentials.h>
#include <Poco/Net/HTTPClientSession.h>
#include <Poco/Net/HTTPCredentials.h>
#include <Poco/Net/HTTPDigestCredentials.h>
#include <Poco/Net/HTTPMessage.h>
#include <Poco/Net/HTTPRequest.h>
#include <Poco/Net/HTTPResponse.h>
#include <Poco/Net/NetException.h>

#include <algorithm>
#include <array>
#include <istream>
#include <optional>
#include <ostream>
#include <thread>
#include <utility>

#include "rws_session.hpp"
#include "rws_session_file.hpp"
#include "weldcell/adapters/host_clock.hpp"
#include "weldcell/wire/rws_pace.hpp"

namespace weldcell::adapters {
namespace {

using Poco::Net::HTTPRequest;
using Poco::Net::HTTPResponse;

using wire::RwsGeneration;

constexpr std::size_t kMostBodyBytes = 16u << 20;
constexpr Nanoseconds kLogoutTimeout = kSecond;

/// "name=value; path=/; httponly" -> {name, value}.
std::optional<std::pair<std::string, std::string>> parse_cookie(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) return std::nullopt;
  const std::size_t end = std::min(text.find(';'), text.size());
  if (end < equals) return std::nullopt;
  return std::pair(text.substr(0, equals), text.substr(equals + 1, end - equals - 1));
}

}  // namespace

struct RwsHttp::State {
  explicit State(RwsAccess a)
      : access(std::move(a)),
        digest(access.user, access.password),
        basic(access.user, access.password),
        rate(access.least_interval, access.burst),
        place("rws " + access.host + ":" + std::to_string(access.port)),
        controller(access.host + ":" + std::to_string(access.port) + (two() ? " 2" : " 1")) {
    if (!access.session_file.empty()) saved = cookies = read_rws_session(access.session_file, controller);
    former = !cookies.empty();
  }

  RwsAccess access;
  Poco::Net::HTTPDigestCredentials digest;
  Poco::Net::HTTPBasicCredentials basic;
  wire::RwsPace rate;
  std::string place, controller;
  std::unique_ptr<Poco::Net::HTTPClientSession> session;
  bool has_nonce = false;
  bool fresh_connection = true;
  RwsCookies cookies, saved;  ///< in use; in session_file
  bool former = false, session_fault_told = false;
  std::optional<Error> session_fault;
  RwsHttpCounters counters;

  Error fault(const char* code, const std::string& what, const char* mend) const {
    return {code, place, what, mend};
  }
  bool two() const { return access.generation == RwsGeneration::Two; }
  void pace();
  std::string cookie_line() const;
  ports::HttpReply send_once(const ports::HttpRequest& request, HTTPResponse& response, HTTPRequest& wire);
  void keep_cookies(const HTTPResponse& response);
  void keep_session();
  std::optional<Error> answer_challenge(HTTPRequest& wire, const HTTPResponse& response);
  Result<ports::HttpReply> exchange(const ports::HttpRequest& request);
};

void RwsHttp::State::pace() {
  const Nanoseconds wait = rate.wait(now());
  if (wait > 0) std::this_thread::sleep_for(std::chrono::nanoseconds(wait));
  rate.started(now());
}

std::string RwsHttp::State::cookie_line() const {
  std::string line;
  for (const auto& [name, value] : cookies) line += (line.empty() ? "" : "; ") + name + "=" + value;
  return line;
}

void RwsHttp::State::keep_cookies(const HTTPResponse& response) {
  for (auto header = response.find("Set-Cookie");
       header != response.end() && Poco::icompare(header->first, "Set-Cookie") == 0; ++header) {
    if (auto cookie = parse_cookie(header->second)) cookies[cookie->first] = cookie->second;
  }
  keep_session();
}

void RwsHttp::State::keep_session() {
  // Durable before the next request: only a session that is known afterwards may take mastership.
  if (access.session_file.empty() || cookies == saved) return;
  const Status written = write_rws_session(access.session_file, controller, cookies);
  if (written.ok()) {
    saved = cookies;
    session_fault_told = false;
  } else if (!std::exchange(session_fault_told, true)) {
    session_fault = written.error();
  }
}

ports::HttpReply RwsHttp::State::send_once(const ports::HttpRequest& request, HTTPResponse& response,
                                           HTTPRequest& wire) {
  if (!request.body.empty() || (request.method != "GET" && !request.content_type.empty())) {
    wire.setContentType(request.content_type);
    wire.setContentLength64(static_cast<Poco::Int64>(request.body.size()));
  }
  if (!request.accept.empty()) wire.set("Accept", request.accept);
  if (const std::string line = cookie_line(); !line.empty()) wire.set("Cookie", line);
  pace();
  ++counters.requests;
  const HostTime deadline = now() + 4 * access.timeout;
  session->sendRequest(wire) << request.body << std::flush;
  std::istream& in = session->receiveResponse(response);
  ports::HttpReply reply;
  std::array<char, 16384> piece;
  while (in.read(piece.data(), piece.size()), in.gcount() > 0) {
    reply.body.append(piece.data(), static_cast<std::size_t>(in.gcount()));
    if (reply.body.size() > kMostBodyBytes) throw Poco::DataException("the body is larger than 16 MB");
    if (now() > deadline) throw Poco::TimeoutException("the body does not end");
  }
  reply.status = response.getStatus();
  for (const auto& [name, value] : response) reply.headers[name] = value;
  keep_cookies(response);
  return reply;
}

std::optional<Error> RwsHttp::State::answer_challenge(HTTPRequest& wire, const HTTPResponse& response) {
  for (const auto& [name, value] : response) {
    if (Poco::icompare(name, "WWW-Authenticate") != 0) continue;
    if (two() && Poco::Net::HTTPCredentials::isBasicCredentials(value)) {
      basic.authenticate(wire);
      has_nonce = true;
      ++counters.challenges;
      return std::nullopt;
    }
    if (two() || !Poco::Net::HTTPCredentials::isDigestCredentials(value)) continue;
    digest.authenticate(wire, Poco::Net::HTTPAuthenticationParams(value.substr(7)));
    has_nonce = true;
    ++counters.challenges;
    return std::nullopt;
  }
  return fault(
      "http.refused",
      std::string("the controller asks for another authentication than ") + (two() ? "basic" : "digest"),
      "check rws.address and rws.generation: RWS 1.0 is IRC5, RobotWare 6, RWS 2.0 is OmniCore");
}

Result<ports::HttpReply> RwsHttp::State::exchange(const ports::HttpRequest& request) {
  bool challenged = false, reconnected = false;
  int overloads = 0;
  std::optional<HTTPResponse> challenge;
  for (;;) {
    const bool kept = session && !fresh_connection;
    try {
      if (!session) {
        session = make_rws_session(access);
        fresh_connection = true;
      }
      HTTPRequest wire(request.method, request.path, HTTPRequest::HTTP_1_1);
      if (challenge) {
        if (auto error = answer_challenge(wire, *challenge)) return *error;
        challenge.reset();
      } else if (has_nonce && two()) {
        basic.authenticate(wire);
      } else if (has_nonce) {
        digest.updateAuthInfo(wire);
      }
      HTTPResponse response;
      ports::HttpReply reply = send_once(request, response, wire);
      fresh_connection = false;
      if (reply.status == HTTPResponse::HTTP_UNAUTHORIZED) {
        if (challenged)
          return fault("http.refused", "user '" + access.user + "' or its password is not accepted",
                       "correct rws.user and the credential rws-password; the user needs the grants of "
                       "docs/COMMISSIONING.md");
        challenged = true;
        challenge = response;
        continue;
      }
      if (reply.status != HTTPResponse::HTTP_SERVICE_UNAVAILABLE) return reply;
      ++counters.overloads;
      // Refused before anything was done: asked again, after the pause that the controller needs.
      if (overloads++ == access.overload_retries) return reply;
      rate.hold_until(now() + access.overload_pause);
    } catch (const WrongCertificate& e) {
      session.reset();
      return fault("http.certificate", e.message(),
                   "if the controller got a new certificate, check it there and write its fingerprint to "
                   "rws.certificate_sha256; else somebody stands in between");
    } catch (const Poco::TimeoutException&) {
      session.reset();
      return fault("http.timeout", "no answer to " + request.method + " " + request.path,
                   "check controller and network");
    } catch (const Poco::Exception& e) {
      session.reset();
      if (kept && request.method == "GET" && !reconnected) {
        reconnected = true;
        ++counters.reconnects;
        continue;
      }
      return fault("http.unreachable", request.method + " " + request.path + ": " + e.displayText(),
                   "check that the controller runs, and rws.address and rws.generation");
    }
  }
}

RwsHttp::RwsHttp(RwsAccess access) : state_(std::make_unique<State>(std::move(access))) {}
RwsHttp::~RwsHttp() { static_cast<void>(logout()); }

Result<ports::HttpReply> RwsHttp::exchange(const ports::HttpRequest& request) {
  return state_->exchange(request);
}
const RwsHttpCounters& RwsHttp::counters() const { return state_->counters; }
const RwsAccess& RwsHttp::access() const { return state_->access; }
std::string RwsHttp::cookie_header() const { return state_->cookie_line(); }

void RwsHttp::take_turn() {
  state_->pace();
  ++state_->counters.requests;
}

bool RwsHttp::has_former_session() const { return state_->former; }
std::optional<Error> RwsHttp::take_session_fault() {
  return std::exchange(state_->session_fault, std::nullopt);
}

Status RwsHttp::logout() {
  State& s = *state_;
  if (s.cookies.empty()) return Done{};
  const Nanoseconds usual = std::exchange(s.access.timeout, std::min(s.access.timeout, kLogoutTimeout));
  s.session.reset();
  const auto reply = s.exchange({"GET", "/logout", "", "", s.two() ? "application/xhtml+xml;v=2.0" : ""});
  s.access.timeout = usual;
  s.session.reset();
  if (!reply.ok()) return reply.error();
  if (reply->status == HTTPResponse::HTTP_SERVICE_UNAVAILABLE)
    return s.fault("http.overloaded", "GET /logout was answered 503", "wait; it is tried again");
  s.cookies.clear();
  s.saved.clear();
  s.former = false;
  if (!s.access.session_file.empty()) remove_rws_session(s.access.session_file);
  return Done{};
}

}  // namespace weldcell::adapters
