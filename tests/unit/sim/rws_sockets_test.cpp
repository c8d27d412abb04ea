// Subscriptions as public clients make and keep them, over real sockets, in both generations.
#include <Poco/Net/Context.h>
#include <Poco/Net/HTTPBasicCredentials.h>
#include <Poco/Net/HTTPCookie.h>
#include <Poco/Net/HTTPCredentials.h>
#include <Poco/Net/HTTPRequest.h>
#include <Poco/Net/HTTPResponse.h>
#include <Poco/Net/HTTPSClientSession.h>
#include <Poco/Net/NetException.h>
#include <Poco/Net/WebSocket.h>
#include <Poco/StreamCopier.h>

#include <mutex>
#include <regex>

#include "fixture.hpp"
#include "sim/rws_server.hpp"
#include "sim/rws_sessions.hpp"
#include "sim/rws_subscriptions.hpp"

namespace weldcell::sim {
namespace {

namespace net = Poco::Net;
using net::WebSocket;

constexpr int kPing = int{WebSocket::FRAME_FLAG_FIN} | int{WebSocket::FRAME_OP_PING};

struct Answer {
  int status = 0;
  std::string location, body;
};

/// A controller of one generation behind its server.
struct Site {
  explicit Site(int generation_, double requests_per_s = 0)
      : generation(generation_), scene(make(generation_)), controller(scene, scene.cell.setup.arm) {
    RwsServerOptions options;
    options.endpoint = {"127.0.0.1", 0};
    options.requests_per_s = requests_per_s;
    options.ping_interval_s = 0.2;
    server = std::make_unique<RwsServer>(std::move(options), controller, lock);
  }
  static Scene make(int generation) {
    Scene scene = test_scene();
    scene.controller.rws_generation = generation;
    return scene;
  }
  void inject(const std::string& fault, double duration_s = 0) {
    const std::lock_guard<std::mutex> hold(lock);
    controller.inject(fault, duration_s);
  }
  void step(int cycles) {
    const std::lock_guard<std::mutex> hold(lock);
    for (int i = 0; i < cycles; ++i) controller.step(now = now + 4 * kMillisecond);
  }
  const char* state() const {
    return generation == 2 ? "/rw/panel/ctrl-state;ctrlstate" : "/rw/panel/ctrlstate;ctrlstate";
  }

  const int generation;
  Scene scene;
  std::mutex lock;
  Controller controller;
  HostTime now;
  std::unique_ptr<RwsServer> server;
};

/// A client as the public ones are: credentials when asked, the cookies it was given ever after.
class Client {
 public:
  explicit Client(Site& site) : site_(site) {}

  Answer ask(const std::string& method, const std::string& path, const std::string& body = "") {
    Answer out = once(method, path, body, "");
    if (out.status == 401) out = once(method, path, body, challenge_);
    return out;
  }
  /// The HTTP status when the WebSocket is refused.
  int open(const std::string& poll, const std::string& protocol, bool with_cookie = true) {
    const auto session = connection();
    net::HTTPRequest request("GET", poll, "HTTP/1.1");
    net::HTTPResponse response;
    request.set("Sec-WebSocket-Protocol", protocol);
    if (with_cookie) request.setCookies(cookies_);
    try {
      socket = std::make_unique<WebSocket>(*session, request, response);
      socket->setReceiveTimeout(Poco::Timespan(5, 0));
      return 101;
    } catch (const net::WebSocketException&) {
      return response.getStatus();
    }
  }
  int open(const std::string& poll) { return open(poll, protocol()); }
  const char* protocol() const { return site_.generation == 2 ? "rws_subscription" : "robapi2_subscription"; }

  /// The next frame of one of these kinds; its payload, or the code of a close frame as text.
  std::string frame(int wanted) {
    for (int i = 0; i < 50; ++i) {
      Poco::Buffer<char> buffer(0);
      int flags = 0;
      const int size = socket->receiveFrame(buffer, flags);
      if (size == 0 && flags == 0) return "ended";
      if ((flags & WebSocket::FRAME_OP_BITMASK) != wanted) continue;
      if (wanted == WebSocket::FRAME_OP_CLOSE && size >= 2)
        return std::to_string((static_cast<unsigned char>(buffer[0]) << 8) |
                              static_cast<unsigned char>(buffer[1])) +
               " " + std::string(buffer.begin() + 2, static_cast<std::size_t>(size) - 2);
      return {buffer.begin(), static_cast<std::size_t>(size)};
    }
    return "none";
  }
  std::string event() { return frame(WebSocket::FRAME_OP_TEXT); }

  std::unique_ptr<WebSocket> socket;

 private:
  std::unique_ptr<net::HTTPClientSession> connection() const {
    const auto port = static_cast<Poco::UInt16>(site_.server->port());
    if (site_.generation == 1) return std::make_unique<net::HTTPClientSession>("127.0.0.1", port);
    net::Context::Params params;
    params.verificationMode = net::Context::VERIFY_NONE;
    return std::make_unique<net::HTTPSClientSession>(
        "127.0.0.1", port, net::Context::Ptr(new net::Context(net::Context::TLS_CLIENT_USE, params)));
  }

  Answer once(const std::string& method, const std::string& path, const std::string& body,
              const std::string& challenge) {
    const auto session = connection();
    net::HTTPRequest request(method, path, "HTTP/1.1");
    net::HTTPResponse response;
    request.setCookies(cookies_);
    if (site_.generation == 2) request.set("Accept", "application/xhtml+xml;v=2.0");
    if (method != "GET") {
      request.setContentType(site_.generation == 2 ? "application/x-www-form-urlencoded;v=2.0"
                                                   : "application/x-www-form-urlencoded");
      request.setContentLength(static_cast<std::streamsize>(body.size()));
    }
    if (!challenge.empty()) {
      response.set("WWW-Authenticate", challenge);
      net::HTTPCredentials("Default User", "robotics").authenticate(request, response);
      response.clear();
    }
    session->sendRequest(request) << body;
    Answer out;
    Poco::StreamCopier::copyToString(session->receiveResponse(response), out.body);
    out.status = response.getStatus();
    out.location = response.get("Location", "");
    challenge_ = response.get("WWW-Authenticate", "");
    std::vector<net::HTTPCookie> given;
    response.getCookies(given);
    for (const auto& cookie : given) cookies_.set(cookie.getName(), cookie.getValue());
    return out;
  }

  Site& site_;
  std::string challenge_;
  net::NameValueCollection cookies_;
};

std::string poll_of(const Answer& made) { return made.location.substr(made.location.find("/poll/")); }

class RwsSockets : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Generations, RwsSockets, ::testing::Values(1, 2));

TEST_P(RwsSockets, EveryClientsFormOfASubscriptionIsUnderstood) {
  Site site(GetParam());
  const std::string state = site.state(), mode = "/rw/panel/opmode;opmode";
  std::string encoded = state;
  for (std::size_t at; (at = encoded.find('/')) != std::string::npos;) encoded.replace(at, 1, "%2F");
  encoded.replace(encoded.find(';'), 1, "%3B");
  const std::string bodies[] = {
      "resources=0&0=" + state + "&0-p=1&resources=1&1=" + mode + "&1-p=0",  // librws counts from 0
      "resources=2&1=" + state + "&1-p=1&2=" + mode + "&2-p=0",              // the TypeScript client: once
      "resources=1&1=" + encoded + "&1-p=1",                                 // the python clients encode
  };
  for (const std::string& body : bodies) {
    Client client(site);
    const Answer made = client.ask("POST", "/subscription", body);
    ASSERT_EQ(made.status, 201) << body << "\n" << made.body;
    EXPECT_EQ(made.location.rfind(GetParam() == 2 ? "wss://" : "ws://", 0), 0u) << made.location;
    std::smatch found;
    const std::regex python("<a href=\"wss?://[^\"]*/poll/([0-9]+)\" rel=\"self\">");
    ASSERT_TRUE(std::regex_search(made.body, found, python)) << made.body;
    EXPECT_EQ("/poll/" + found[1].str(), poll_of(made)) << "header and body name the same";
    EXPECT_NE(made.body.find("href=\"subscription/" + found[1].str() + "\" rel=\"group\""),
              std::string::npos);
    EXPECT_NE(made.body.find("<span class=\"ctrlstate\">motoroff</span>"), std::string::npos)
        << "the first values come with the answer";
    EXPECT_EQ(client.ask("GET", "/logout").status, 200);
  }
  EXPECT_EQ(site.server->subscriptions(), 0u) << "logging out ends them";
}

TEST_P(RwsSockets, EventsComeAsXhtmlWithTheSubscribedName) {
  Site site(GetParam());
  Client client(site);
  const Answer made =
      client.ask("POST", "/subscription",
                 std::string("resources=1&1=") + site.state() + "&1-p=1&resources=2&2=/rw/elog/0&2-p=1");
  ASSERT_EQ(made.status, 201) << made.body;
  ASSERT_EQ(client.open(poll_of(made)), 101);
  site.inject("estop");
  std::string seen = client.event();
  if (seen.find("elog-message-ev") == std::string::npos) seen += client.event();
  EXPECT_NE(seen.find("<html xmlns=\"http://www.w3.org/1999/xhtml\">"), std::string::npos) << seen;
  EXPECT_NE(
      seen.find("<li class=\"pnl-ctrlstate-ev\" title=\"ctrlstate\"><a href=\"" + std::string(site.state()) +
                "\" rel=\"self\"/><span class=\"ctrlstate\">emergencystop</span>"),
      std::string::npos)
      << seen;
  EXPECT_NE(seen.find("<span class=\"seqnum\">2</span>"), std::string::npos) << seen;
}

TEST_P(RwsSockets, TheWebSocketWantsItsProtocolAndItsSession) {
  Site site(GetParam());
  Client client(site), other(site);
  const Answer made =
      client.ask("POST", "/subscription", std::string("resources=1&1=") + site.state() + "&1-p=1");
  const std::string poll = poll_of(made);
  ASSERT_EQ(other.ask("GET", "/rw/panel/opmode").status, 200);
  EXPECT_EQ(client.open(poll, GetParam() == 2 ? "robapi2_subscription" : "rws_subscription"), 400);
  EXPECT_EQ(client.open(poll, client.protocol(), false), 401);
  EXPECT_EQ(other.open(poll), 403);
  EXPECT_EQ(client.open("/poll/999"), 404);
  EXPECT_EQ(client.open(poll), 101);
}

TEST_P(RwsSockets, APollPathIsReopenedOrSpent) {
  Site site(GetParam());
  Client client(site);
  const std::string poll =
      poll_of(client.ask("POST", "/subscription", std::string("resources=1&1=") + site.state() + "&1-p=1"));
  ASSERT_EQ(client.open(poll), 101);
  client.socket->close();
  int status = 0;
  // The server notices the end at its next turn.
  for (int i = 0; i < 100 && status != 101; ++i) {
    status = client.open(poll);
    if (GetParam() == 2 && site.server->subscriptions() == 0) break;
    if (status != 101) Poco::Thread::sleep(20);
  }
  EXPECT_EQ(GetParam() == 2 ? client.open(poll) : status, GetParam() == 2 ? 404 : 101);
}

TEST_P(RwsSockets, DeletedIsGone) {
  Site site(GetParam());
  Client client(site);
  const std::string poll =
      poll_of(client.ask("POST", "/subscription", std::string("resources=1&1=") + site.state() + "&1-p=1"));
  EXPECT_EQ(
      client.ask("PUT", "/subscription/" + poll.substr(6), "resources=1&1=/rw/panel/opmode;opmode&1-p=1")
          .status,
      200);
  EXPECT_EQ(client.ask("DELETE", "/subscription/" + poll.substr(6)).status, 200);
  EXPECT_EQ(client.open(poll), 404);
  EXPECT_EQ(client.ask("DELETE", "/subscription/" + poll.substr(6)).status, 404);
}

TEST_P(RwsSockets, WhatCannotBeSubscribedIsRefused) {
  Site site(GetParam());
  Client client(site);
  const std::string state = site.state();
  const std::string refused[] = {"",
                                 "resources=1",
                                 "resources=1&1=/rw/nothing&1-p=1",
                                 "resources=1&1=" + state,
                                 "resources=1&1=" + state + "&1-p=7",
                                 "resources=1&1=" + state + "&1-p=2",  // high is for signals and persistents
                                 GetParam() == 2 ? "resources=1&1=/rw/panel/ctrlstate;ctrlstate&1-p=1"
                                                 : "resources=1&1=/rw/panel/ctrl-state;ctrlstate&1-p=1"};
  for (const std::string& body : refused) {
    const Answer answer = client.ask("POST", "/subscription", body);
    EXPECT_EQ(answer.status, 400) << body;
    EXPECT_NE(answer.body.find("<span class=\"code\">-107"), std::string::npos) << answer.body;
  }
  std::string quick = "resources=1";
  for (int i = 1; i <= 65; ++i) {
    char name[24];
    std::snprintf(name, sizeof name, "doSpare%03d", i);
    quick +=
        "&" + std::to_string(i) + "=/rw/iosystem/signals/" + name + ";state&" + std::to_string(i) + "-p=2";
  }
  EXPECT_EQ(client.ask("POST", "/subscription", quick).status, 400) << "64 of high priority";
  EXPECT_EQ(client.ask("POST", "/subscription", quick.substr(0, quick.rfind("&65="))).status, 201);
}

TEST_P(RwsSockets, ARestartForgetsSessionsAndSubscriptions) {
  Site site(GetParam());
  Client client(site);
  const std::string poll =
      poll_of(client.ask("POST", "/subscription", std::string("resources=1&1=") + site.state() + "&1-p=1"));
  ASSERT_EQ(client.open(poll), 101);
  site.inject("restart", 0.4);
  const std::string end = client.frame(WebSocket::FRAME_OP_CLOSE);
  EXPECT_TRUE(end == "ended" || end.rfind("100", 0) == 0) << end;
  EXPECT_THROW(client.ask("GET", "/rw/system"), Poco::Exception) << "away: connections end without an answer";
  site.step(120);
  EXPECT_EQ(client.open(poll), 401) << "the cookie is unknown";
  EXPECT_EQ(client.ask("GET", "/rw/system").status, 200);
  EXPECT_EQ(client.open(poll), 404);
  EXPECT_EQ(site.server->sessions(), 1u);
}

TEST_P(RwsSockets, EveryResourceThatClientsWatchTellsItsChange) {
  Site site(GetParam());
  {
    const std::lock_guard<std::mutex> hold(site.lock);
    ASSERT_TRUE(
        site.controller.load_module("MODULE T\n PERS num n:=1;\n PROC main()\n  n:=2;\n  WaitTime 1;\n "
                                    "ENDPROC\nENDMODULE"));
  }
  Client client(site);
  const bool two = GetParam() == 2;
  const std::string edit = two ? "edit" : "rapid";
  const std::string symbol =
      two ? "/rw/rapid/symbol/RAPID/T_ROB1/T/n/data" : "/rw/rapid/symbol/data/RAPID/T_ROB1/T/n";
  const std::string signal = "/rw/iosystem/signals/EtherNetIP/Local_IO/doArcOn";
  const auto act = [&](const std::string& path, const std::string& verb, const std::string& body = "") {
    const int status = client.ask("POST", two ? path + "/" + verb : path + "?action=" + verb, body).status;
    EXPECT_EQ(status, 204) << path << " " << verb;
  };
  const std::pair<std::string, std::string> watched[] = {
      {site.state(), "pnl-ctrlstate-ev"},
      {"/rw/panel/speedratio;speedratio", "pnl-speedratio-ev"},
      {"/rw/rapid/execution;ctrlexecstate", "rap-ctrlexecstate-ev"},
      {"/rw/rapid/execution;rapidexeccycle", "rap-execcycle-ev"},
      {signal + ";state", "ios-signalstate-ev"},
      {symbol + ";value", "rap-value-ev"},
      {"/rw/elog/0", "elog-message-ev"},
      {"/rw/mastership", "msh-resource-value"},
      {"/rw/rapid/tasks/T_ROB1;taskchange", "rap-task-ev"},
      {"/rw/rapid/tasks/T_ROB1/pcp;motionpointerchange", "rap-mp-ev"},
      {"/rw/rapid/uiinstr;uievent", ""},
      {"/rw/panel/opmode;opmode", "pnl-opmode-ev"}};
  std::string body = "resources=" + std::to_string(std::size(watched));
  for (std::size_t i = 0; i < std::size(watched); ++i) {
    const std::string number = std::to_string(i + 1);
    body += "&" + number + "=" + watched[i].first + "&" + number + "-p=1";
  }
  const Answer made = client.ask("POST", "/subscription", body);
  ASSERT_EQ(made.status, 201) << made.body;
  EXPECT_NE(made.body.find("rap-ui-ev"), std::string::npos);
  ASSERT_EQ(client.open(poll_of(made)), 101);
  act("/rw/mastership/" + edit, "request");
  const std::string panel = two ? "/rw/panel/ctrl-state" : "/rw/panel/ctrlstate?action=setctrlstate";
  EXPECT_EQ(client.ask("POST", panel, "ctrl-state=motoron").status, 204);
  EXPECT_EQ(client.ask("POST", "/rw/panel/speedratio?action=setspeedratio", "speed-ratio=50").status, 204);
  act("/rw/rapid/execution", two ? "cycle" : "setcycle", "cycle=forever");
  act(signal, two ? "set-value" : "set", "lvalue=1");
  act("/rw/rapid/execution", "resetpp");
  act("/rw/rapid/execution", "start",
      "regain=continue&execmode=continue&cycle=forever&condition=none&stopatbp=disabled&alltaskbytsp=false");
  site.step(20);
  std::string seen;
  const auto missing = [&] {
    for (const auto& [uri, type] : watched) {
      if (type != "pnl-opmode-ev" && seen.find(type) == std::string::npos) return true;
    }
    return false;
  };
  for (int i = 0; i < 12 && missing(); ++i) seen += client.event();
  // Turning the key also takes back what came before it.
  site.inject("manual");
  for (int i = 0; i < 12 && seen.find("pnl-opmode-ev") == std::string::npos; ++i) seen += client.event();
  for (const auto& [uri, type] : watched) {
    EXPECT_NE(seen.find(type), std::string::npos) << uri << "\n" << seen;
    if (type != "elog-message-ev" && !type.empty()) {
      EXPECT_NE(seen.find("href=\"" + uri + "\" rel=\"self\""), std::string::npos) << uri;
    }
  }
}

TEST_P(RwsSockets, LoggingOutGivesMastershipBack) {
  Site site(GetParam());
  Client client(site), other(site);
  const std::string path =
      GetParam() == 2 ? "/rw/mastership/edit/request" : "/rw/mastership/rapid?action=request";
  EXPECT_EQ(client.ask("POST", path).status, 204);
  EXPECT_EQ(other.ask("POST", path).status, 403);
  EXPECT_EQ(client.ask("GET", "/logout").status, 200);
  EXPECT_EQ(other.ask("POST", path).status, 204);
}

TEST_P(RwsSockets, AThousandResourcesAGroup) {
  Site site(GetParam());
  Client client(site);
  std::string body = "resources=1";
  for (int i = 1; i <= 1001; ++i)
    body += "&" + std::to_string(i) + "=/rw/panel/opmode;opmode&" + std::to_string(i) + "-p=1";
  EXPECT_EQ(client.ask("POST", "/subscription", body).status, 400);
  EXPECT_EQ(client.ask("POST", "/subscription", body.substr(0, body.rfind("&1001="))).status, 201);
}

TEST_P(RwsSockets, TooManyRequestsAreAnswered503) {
  Site site(GetParam(), 10);
  Client client(site);
  int busy = 0;
  for (int i = 0; i < 40; ++i) busy += client.ask("GET", "/rw/panel/opmode").status == 503;
  EXPECT_GT(busy, 0);
}

TEST(RwsSocketsOne, PingsAndAnswersPings) {
  Site site(1);
  Client client(site);
  const std::string poll =
      poll_of(client.ask("POST", "/subscription", "resources=1&1=/rw/panel/opmode&1-p=1"));
  ASSERT_EQ(client.open(poll), 101);
  EXPECT_EQ(client.frame(WebSocket::FRAME_OP_PING), "");
  client.socket->sendFrame("hi", 2, kPing);
  EXPECT_EQ(client.frame(WebSocket::FRAME_OP_PONG), "hi");
  Client third(site);
  EXPECT_EQ(third.ask("POST", "/subscription", "resources=1&1=/rw/panel/opmode&1-p=1").status, 201);
  EXPECT_EQ(third.ask("POST", "/subscription", "resources=1&1=/rw/panel/opmode&1-p=1").status, 201);
  EXPECT_EQ(third.ask("POST", "/subscription", "resources=1&1=/rw/panel/opmode&1-p=1").status, 403)
      << "two groups a client";
}

TEST(RwsSocketsTwo, ClosesWhenTheClientSendsData) {
  Site site(2);
  Client client(site);
  const std::string poll =
      poll_of(client.ask("POST", "/subscription", "resources=1&1=/rw/panel/opmode;opmode&1-p=1"));
  ASSERT_EQ(client.open(poll), 101);
  client.socket->sendFrame("hi", 2, kPing);  // unanswered, and no reason to close
  client.socket->sendFrame("x", 1, WebSocket::FRAME_TEXT);
  EXPECT_EQ(client.frame(WebSocket::FRAME_OP_CLOSE), "1008 Client cannot send data");
}

TEST(RwsSocketsTwo, AsksForBasicAndHasFewSessions) {
  RwsSessions sessions("Default User", "robotics", 1, 2);
  const auto first = sessions.admit("GET", "/", "", "", 1);
  EXPECT_EQ(first.challenge.rfind("Basic ", 0), 0u);
  EXPECT_EQ(sessions.admit("GET", "/", "Basic d3Jvbmc6d3Jvbmc=", "", 1).verdict,
            RwsAccess::Verdict::Challenge);
  const std::string right = "Basic RGVmYXVsdCBVc2VyOnJvYm90aWNz";
  for (std::size_t i = 0; i < kRws2MaxSessions; ++i)
    EXPECT_EQ(sessions.admit("GET", "/", right, "", 1).verdict, RwsAccess::Verdict::Allowed);
  EXPECT_EQ(sessions.admit("GET", "/", right, "", 1).verdict, RwsAccess::Verdict::Full);
}

}  // namespace
}  // namespace weldcell::sim
