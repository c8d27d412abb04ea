// RWS 1.0: states, rights, errors, bodies; digest and sessions; the server over a socket.
#include <Poco/Net/HTTPClientSession.h>
#include <Poco/Net/HTTPCredentials.h>
#include <Poco/Net/HTTPRequest.h>
#include <Poco/Net/HTTPResponse.h>
#include <Poco/StreamCopier.h>

#include <mutex>
#include <nlohmann/json.hpp>

#include "fixture.hpp"
#include "sim/rws_server.hpp"
#include "sim/rws_sessions.hpp"

namespace weldcell::sim {

namespace {

constexpr const char* kModule =
    "MODULE T\n PERS num n:=1;\n CONST num c:=2;\n PERS bool b:=FALSE;\n PROC main()\n  WaitTime 1;\n "
    "ENDPROC\nENDMODULE";

long code_of(const ports::HttpReply& reply) {
  return nlohmann::json::parse(reply.body)["_embedded"]["status"]["code"].get<long>();
}

}  // namespace

TEST(Rws, StartNeedsMotorsPointerAndRest) {
  Bench bench;
  const std::string start = "/rw/rapid/execution?action=start&json=1";
  EXPECT_EQ(bench.rws("PUT", "/fileservice/$HOME/t.mod", kModule).status, 201);
  EXPECT_EQ(
      bench.rws("POST", "/rw/rapid/tasks/T_ROB1?action=loadmod&json=1", "modulepath=$HOME/T.MOD&replace=true")
          .status,
      403);
  EXPECT_EQ(bench.rws("POST", "/rw/mastership/rapid?action=request").status, 204);
  EXPECT_EQ(
      bench.rws("POST", "/rw/rapid/tasks/T_ROB1?action=loadmod&json=1", "modulepath=$HOME/T.MOD&replace=true")
          .status,
      204);
  const auto motors_off = bench.rws("POST", start, Bench::kStart);
  EXPECT_EQ(motors_off.status, 400);
  EXPECT_EQ(code_of(motors_off), -1073442809);
  EXPECT_EQ(bench.rws("POST", "/rw/panel/ctrlstate?action=setctrlstate", "ctrl-state=motoron").status, 204);
  EXPECT_EQ(bench.rws("POST", start, Bench::kStart).status, 400) << "PP is not set";
  EXPECT_EQ(bench.rws("POST", "/rw/rapid/execution?action=resetpp").status, 204);
  EXPECT_EQ(bench.rws("POST", start, "regain=continue").status, 400) << "arguments are missing";
  EXPECT_EQ(bench.rws("POST", start, Bench::kStart).status, 204);
  EXPECT_EQ(bench.rws("POST", start, Bench::kStart).status, 400) << "runs already";
  EXPECT_EQ(
      bench.rws("POST", "/rw/rapid/tasks/T_ROB1?action=loadmod&json=1", "modulepath=$home/t.mod&replace=true")
          .status,
      403);
  bench.step(300);
  EXPECT_NE(bench.rws("GET", "/rw/rapid/execution?json=1").body.find("\"ctrlexecstate\":\"stopped\""),
            std::string::npos);
}

TEST(Rws, LoadErrorNamesTheLine) {
  Bench bench;
  bench.rws("POST", "/rw/mastership/rapid?action=request");
  bench.rws("PUT", "/fileservice/$home/bad.mod",
            "MODULE Bad\n PROC main()\n  MoveL;;\n  x:=;\n ENDPROC\nENDMODULE");
  const auto reply = bench.rws("POST", "/rw/rapid/tasks/T_ROB1?action=loadmod&json=1",
                               "modulepath=$HOME/bad.mod&replace=true");
  EXPECT_EQ(reply.status, 400);
  EXPECT_NE(reply.body.find("line 4"), std::string::npos) << reply.body;
  EXPECT_EQ(code_of(bench.rws("POST", "/rw/rapid/tasks/T_ROB1?action=loadmod&json=1",
                              "modulepath=$HOME/none.mod&replace=true")),
            -1073438708);
}

TEST(Rws, SymbolsAreTypedAndNeedMastership) {
  Bench bench;
  ASSERT_TRUE(bench.controller.load_module(kModule));
  const std::string n = "/rw/rapid/symbol/data/RAPID/T_ROB1/T/n", set = n + "?action=set&json=1";
  EXPECT_EQ(code_of(bench.rws("POST", set, "value=5")), -1073445859);
  bench.rws("POST", "/rw/mastership/rapid?action=request", "", 2);
  EXPECT_EQ(code_of(bench.rws("POST", set, "value=5")), -1073445862) << "held by session 2";
  EXPECT_EQ(code_of(bench.rws("POST", "/rw/mastership/rapid?action=request&json=1")), -1073445862);
  bench.controller.end_rws_session(2);
  EXPECT_EQ(bench.rws("POST", "/rw/mastership/rapid?action=request").status, 204);
  EXPECT_EQ(bench.rws("POST", set, "value=5").status, 204);
  EXPECT_EQ(bench.value("T", "n"), "5");
  EXPECT_EQ(bench.rws("POST", set, "value=TRUE").status, 400);
  EXPECT_EQ(bench.rws("POST", set, "value=[1]").status, 400);
  EXPECT_EQ(bench.rws("POST", "/rw/rapid/symbol/data/RAPID/T_ROB1/T/c?action=set", "value=3").status, 403);
  EXPECT_EQ(code_of(bench.rws("GET", "/rw/rapid/symbol/data/RAPID/T_ROB1/T/none?json=1")), -1073414146);
  EXPECT_NE(bench.rws("GET", "/rw/rapid/symbol/properties/RAPID/T_ROB1/T/b?json=1")
                .body.find("\"dattyp\":\"bool\""),
            std::string::npos);
}

TEST(Rws, MotorsStayOffInGuardStopAndManualMode) {
  Bench bench;
  bench.controller.inject("guardstop");
  EXPECT_EQ(bench.rws("POST", "/rw/panel/ctrlstate?action=setctrlstate", "ctrl-state=motoron").status, 403);
  EXPECT_NE(bench.rws("GET", "/rw/panel/ctrlstate?json=1").body.find("guardstop"), std::string::npos);
  Scene scene = test_scene();
  scene.controller.auto_mode = false;
  Bench manual(scene);
  EXPECT_EQ(manual.rws("POST", "/rw/panel/ctrlstate?action=setctrlstate", "ctrl-state=motoron").status, 403);
  EXPECT_NE(manual.rws("GET", "/rw/panel/opmode").body.find("<span class=\"opmode\">MANR</span>"),
            std::string::npos);
}

TEST(Rws, ShowsTargetsSystemFilesAndEvents) {
  Bench bench;
  const auto joints =
      nlohmann::json::parse(bench.rws("GET", "/rw/motionsystem/mechunits/ROB_1/jointtarget?json=1").body);
  EXPECT_EQ(joints["_embedded"]["_state"][0]["rax_5"], "90");
  const auto pose =
      nlohmann::json::parse(bench.rws("GET", "/rw/motionsystem/mechunits/ROB_1/robtarget?json=1").body);
  EXPECT_EQ(pose["_embedded"]["_state"][0]["x"], "945");
  EXPECT_TRUE(pose["_embedded"]["_state"][0].contains("eaxa"));
  EXPECT_TRUE(pose["_embedded"]["_state"][0].contains("eax_a"));
  EXPECT_NE(bench.rws("GET", "/rw/system?json=1").body.find("rwversion"), std::string::npos);
  EXPECT_EQ(bench.rws("GET", "/fileservice/$home/none").status, 404);
  EXPECT_EQ(bench.rws("PUT", "/fileservice/$home/A.txt", "x&y=%41").status, 201);
  EXPECT_EQ(bench.rws("GET", "/fileservice/$HOME/a.TXT").body, "x&y=%41");
  EXPECT_EQ(bench.rws("DELETE", "/fileservice/$home/a.txt").status, 204);
  EXPECT_NE(bench.rws("GET", "/rw/elog/0?lang=en&json=1").body.find("Motors OFF"), std::string::npos);
  EXPECT_EQ(bench.rws("GET", "/rw/nonsense").status, 404);
  EXPECT_EQ(bench.rws("GET", "/rw/retcode?code=-1073445862&json=1").status, 200);
  bench.controller.inject("rws_503", 1);
  bench.step();
  EXPECT_EQ(bench.rws("GET", "/rw/system").status, 503);
  bench.step(300);
  EXPECT_EQ(bench.rws("GET", "/rw/system").status, 200);
}

namespace {

std::string authorization(const std::string& challenge, const std::string& password,
                          const std::string& method, const std::string& uri) {
  auto d = parse_digest(challenge);
  const std::string ha1 = md5_hex("Default User:" + d["realm"] + ":" + password),
                    ha2 = md5_hex(method + ":" + uri);
  return "Digest username=\"Default User\", realm=\"" + d["realm"] + "\", nonce=\"" + d["nonce"] +
         "\", uri=\"" + uri + "\", qop=auth, nc=00000001, cnonce=\"abc\", response=\"" +
         md5_hex(ha1 + ":" + d["nonce"] + ":00000001:abc:auth:" + ha2) + "\"";
}

}  // namespace

TEST(RwsSessions, DigestNonceAndCookies) {
  // RFC 2617's own example of the sums.
  EXPECT_EQ(md5_hex("Mufasa:testrealm@host.com:Circle Of Life"), "939e7578ed9e3c518a452acee763bce9");
  RwsSessions sessions("Default User", "robotics", 1);
  const auto first = sessions.admit("GET", "/rw/system", "", "", 10);
  ASSERT_EQ(first.verdict, RwsAccess::Verdict::Challenge);
  EXPECT_EQ(
      sessions
          .admit("GET", "/rw/system", authorization(first.challenge, "wrong", "GET", "/rw/system"), "", 11)
          .verdict,
      RwsAccess::Verdict::Challenge);
  EXPECT_EQ(
      sessions.admit("GET", "/other", authorization(first.challenge, "robotics", "GET", "/rw/system"), "", 11)
          .verdict,
      RwsAccess::Verdict::Challenge);
  const auto right = sessions.admit("GET", "/rw/system",
                                    authorization(first.challenge, "robotics", "GET", "/rw/system"), "", 11);
  ASSERT_EQ(right.verdict, RwsAccess::Verdict::Allowed);
  ASSERT_EQ(right.set_cookies.size(), 2U);
  EXPECT_EQ(right.set_cookies[0].rfind("-http-session-=", 0), 0U);
  EXPECT_EQ(right.set_cookies[1].rfind("ABBCX=", 0), 0U);
  const std::string cookie = "ABBCX=1; " + right.set_cookies[0].substr(0, right.set_cookies[0].find(';'));
  EXPECT_EQ(sessions.admit("GET", "/rw/panel/opmode", "", cookie, 200).session, right.session);
  const auto late = sessions.admit("GET", "/rw/system",
                                   authorization(first.challenge, "robotics", "GET", "/rw/system"), "", 400);
  EXPECT_NE(late.challenge.find("stale=\"TRUE\""), std::string::npos);
  EXPECT_EQ(sessions.admit("GET", "/rw/system", "", cookie, 501).verdict, RwsAccess::Verdict::Challenge)
      << "300 s of silence";
  EXPECT_EQ(sessions.take_expired(), std::vector<int>{right.session});
}

TEST(RwsSessions, SeventyAreEnough) {
  RwsSessions sessions("Default User", "robotics", 1);
  const std::string header =
      authorization(sessions.admit("GET", "/x", "", "", 0).challenge, "robotics", "GET", "/x");
  int last = 0;
  for (std::size_t i = 0; i < kRwsMaxSessions; ++i) last = sessions.admit("GET", "/x", header, "", 1).session;
  EXPECT_EQ(sessions.admit("GET", "/x", header, "", 1).verdict, RwsAccess::Verdict::Full);
  sessions.log_out(last);
  EXPECT_EQ(sessions.admit("GET", "/x", header, "", 1).verdict, RwsAccess::Verdict::Allowed);
}

TEST(RwsServer, AnswersAPocoClientWithDigest) {
  Scene scene = test_scene();
  Controller controller(scene, scene.cell.setup.arm);
  std::mutex lock;
  RwsServerOptions options;
  options.endpoint = {"127.0.0.1", 0};
  RwsServer server(std::move(options), controller, lock);
  namespace net = Poco::Net;
  net::HTTPClientSession session("127.0.0.1", static_cast<Poco::UInt16>(server.port()));
  net::HTTPRequest request("GET", "/rw/panel/ctrlstate?json=1", "HTTP/1.1");
  net::HTTPResponse response;
  std::string body;
  session.sendRequest(request);
  Poco::StreamCopier::copyToString(session.receiveResponse(response), body);
  ASSERT_EQ(response.getStatus(), 401);
  net::HTTPCredentials("Default User", "robotics").authenticate(request, response);
  session.sendRequest(request);
  body.clear();
  Poco::StreamCopier::copyToString(session.receiveResponse(response), body);
  EXPECT_EQ(response.getStatus(), 200);
  EXPECT_NE(body.find("motoroff"), std::string::npos);
  EXPECT_EQ(server.sessions(), 1U);
  std::vector<net::HTTPCookie> cookies;
  response.getCookies(cookies);
  ASSERT_EQ(cookies.size(), 2U);
  net::NameValueCollection jar;
  for (const auto& cookie : cookies) jar.add(cookie.getName(), cookie.getValue());
  net::HTTPRequest post("POST", "/rw/panel/ctrlstate?action=setctrlstate", "HTTP/1.1");
  post.setCookies(jar);
  const std::string form = "ctrl-state=motoron";
  post.setContentType("application/x-www-form-urlencoded");
  post.setContentLength(static_cast<std::streamsize>(form.size()));
  session.sendRequest(post) << form;
  session.receiveResponse(response);
  EXPECT_EQ(response.getStatus(), 204);
  {
    const std::lock_guard<std::mutex> hold(lock);
    EXPECT_TRUE(controller.motors_on());
  }
  net::HTTPRequest logout("GET", "/logout", "HTTP/1.1");
  logout.setCookies(jar);
  session.sendRequest(logout);
  body.clear();
  Poco::StreamCopier::copyToString(session.receiveResponse(response), body);
  EXPECT_EQ(server.sessions(), 0U);
}

}  // namespace weldcell::sim
