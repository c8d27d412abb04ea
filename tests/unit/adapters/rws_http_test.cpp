// The carrier against a digest server on loopback that checks every credential by its own arithmetic.
#include "weldcell/adapters/rws_http.hpp"

#include <Poco/MD5Engine.h>
#include <Poco/Net/HTTPRequestHandler.h>
#include <Poco/Net/HTTPRequestHandlerFactory.h>
#include <Poco/Net/HTTPServer.h>
#include <Poco/Net/HTTPServerRequest.h>
#include <Poco/Net/HTTPServerResponse.h>
#include <Poco/Net/ServerSocket.h>
#include <Poco/StreamCopier.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <set>

#include "weldcell/adapters/host_clock.hpp"
#include "weldcell/adapters/rws_client.hpp"

namespace weldcell::adapters {
namespace {

constexpr const char* kRealm = "validusers@robapi.abb";
constexpr const char* kUser = "Default User";
constexpr const char* kPassword = "robotics";

std::string md5(const std::string& text) {
  Poco::MD5Engine engine;
  engine.update(text);
  return Poco::DigestEngine::digestToHex(engine.digest());
}

/// name="value" or name=value of a Digest header.
std::map<std::string, std::string> parts(std::string header) {
  std::map<std::string, std::string> out;
  header.erase(0, header.find(' ') + 1);
  for (std::size_t at = 0; at < header.size();) {
    const std::size_t equals = header.find('=', at);
    if (equals == std::string::npos) break;
    std::size_t name = header.find_first_not_of(" ,", at);
    const bool quoted = header[equals + 1] == '"';
    const std::size_t begin = equals + (quoted ? 2 : 1);
    const std::size_t end = std::min(header.find(quoted ? '"' : ',', begin), header.size());
    out[header.substr(name, equals - name)] = header.substr(begin, end - begin);
    at = end + 1;
  }
  return out;
}

/// What the controller would keep, shared by all handlers.
struct Controller {
  std::mutex mutex;
  int nonce = 1;
  int nonce_uses = 0, uses_a_nonce = 1000;
  std::string scheme = "Digest";
  std::set<std::string> seen;    ///< nonce and count: a replay is refused
  std::vector<std::string> log;  ///< "METHOD uri status"
  std::vector<HostTime> starts;
  std::vector<std::string> cookies;
  std::string last_body, last_type;
  int answer_status = 200;
  int silent_ms = 0;
  bool close_after_answer = false;
};

class Handler : public Poco::Net::HTTPRequestHandler {
 public:
  explicit Handler(Controller& c) : c_(c) {}
  void handleRequest(Poco::Net::HTTPServerRequest& request,
                     Poco::Net::HTTPServerResponse& response) override {
    const std::lock_guard lock(c_.mutex);
    c_.starts.push_back(now());
    std::string body;
    Poco::StreamCopier::copyToString(request.stream(), body);
    bool stale = false;
    const bool trusted = check(request, stale);
    if (!trusted) {
      response.setStatus(Poco::Net::HTTPResponse::HTTP_UNAUTHORIZED);
      response.set("WWW-Authenticate", c_.scheme == "Digest"
                                           ? "Digest realm=\"" + std::string(kRealm) +
                                                 "\", domain=\"/\", nonce=\"n" + std::to_string(c_.nonce) +
                                                 "\", opaque=\"799d5\", algorithm=\"MD5\", qop=\"auth\"" +
                                                 (stale ? ", stale=TRUE" : "")
                                           : c_.scheme + " realm=\"x\"");
    } else {
      if (c_.silent_ms != 0) ::usleep(static_cast<unsigned>(c_.silent_ms) * 1000);
      c_.cookies.push_back(request.get("Cookie", ""));
      c_.last_body = body;
      c_.last_type = request.getContentType();
      response.setStatus(static_cast<Poco::Net::HTTPResponse::HTTPStatus>(c_.answer_status));
      response.add("Set-Cookie", "-http-session-=4::http.session::abc; path=/; domain=127.0.0.1; httponly");
      response.add("Set-Cookie", "ABBCX=" + std::to_string(c_.cookies.size()) + "; path=/; httponly");
    }
    c_.log.push_back(request.getMethod() + " " + request.getURI() + " " +
                     std::to_string(response.getStatus()));
    if (c_.close_after_answer && trusted) response.setKeepAlive(false);
    if (response.getStatus() == 204) {
      response.setContentLength(0);
      response.send();
    } else {
      const std::string text = trusted ? "{\"body\":\"" + body + "\"}" : "<html>login</html>";
      response.sendBuffer(text.data(), text.size());
    }
  }

 private:
  bool check(const Poco::Net::HTTPServerRequest& request, bool& stale) {
    if (!request.has("Authorization")) return false;
    const auto given = parts(request.get("Authorization"));
    const auto get = [&](const char* name) { return given.contains(name) ? given.at(name) : std::string(); };
    if (get("username") != kUser || get("uri") != request.getURI() || get("qop") != "auth" ||
        get("opaque") != "799d5")
      return false;
    const std::string ha1 = md5(std::string(kUser) + ":" + kRealm + ":" + kPassword);
    const std::string ha2 = md5(request.getMethod() + ":" + request.getURI());
    const std::string expected =
        md5(ha1 + ":" + get("nonce") + ":" + get("nc") + ":" + get("cnonce") + ":auth:" + ha2);
    if (get("response") != expected) return false;
    if (get("nonce") != "n" + std::to_string(c_.nonce) || ++c_.nonce_uses > c_.uses_a_nonce) {
      if (get("nonce") == "n" + std::to_string(c_.nonce)) ++c_.nonce;
      c_.nonce_uses = 0;
      stale = true;
      return false;
    }
    return c_.seen.insert(get("nonce") + "/" + get("nc")).second;
  }
  Controller& c_;
};

class Factory : public Poco::Net::HTTPRequestHandlerFactory {
 public:
  explicit Factory(Controller& c) : c_(c) {}
  Poco::Net::HTTPRequestHandler* createRequestHandler(const Poco::Net::HTTPServerRequest&) override {
    return new Handler(c_);
  }

 private:
  Controller& c_;
};

class RwsHttpTest : public ::testing::Test {
 protected:
  void SetUp() override {
    auto parameters = Poco::AutoPtr<Poco::Net::HTTPServerParams>(new Poco::Net::HTTPServerParams);
    parameters->setKeepAlive(true);
    server_ = std::make_unique<Poco::Net::HTTPServer>(
        Poco::SharedPtr<Poco::Net::HTTPRequestHandlerFactory>(new Factory(controller_)),
        Poco::Net::ServerSocket(Poco::Net::SocketAddress("127.0.0.1", 0)), parameters);
    server_->start();
  }
  void TearDown() override { server_->stopAll(true); }
  RwsAccess access() const {
    RwsAccess a;
    a.port = server_->port();
    a.password = kPassword;
    a.least_interval = 0;
    return a;
  }
  Controller controller_;
  std::unique_ptr<Poco::Net::HTTPServer> server_;
};

TEST_F(RwsHttpTest, AnswersTheChallengeOnceAndKeepsNonceAndCookies) {
  RwsHttp http(access());
  for (int i = 0; i < 3; ++i) {
    const auto reply =
        http.exchange({"POST", "/rw/panel/ctrlstate?action=setctrlstate", "ctrl-state=motoron"});
    ASSERT_TRUE(reply.ok()) << reply.error().text();
    EXPECT_EQ(reply->status, 200);
    EXPECT_EQ(reply->body, "{\"body\":\"ctrl-state=motoron\"}");
  }
  EXPECT_EQ(controller_.log, (std::vector<std::string>{"POST /rw/panel/ctrlstate?action=setctrlstate 401",
                                                       "POST /rw/panel/ctrlstate?action=setctrlstate 200",
                                                       "POST /rw/panel/ctrlstate?action=setctrlstate 200",
                                                       "POST /rw/panel/ctrlstate?action=setctrlstate 200"}));
  EXPECT_EQ(controller_.last_type, "application/x-www-form-urlencoded");
  EXPECT_EQ(controller_.cookies[0], "");
  EXPECT_EQ(controller_.cookies[2], "-http-session-=4::http.session::abc; ABBCX=2") << "the newest of each";
  EXPECT_EQ(http.counters().challenges, 1u);
  EXPECT_EQ(http.counters().requests, 4u);
}

TEST_F(RwsHttpTest, AStaleNonceIsRenewedWithoutTheCallerKnowing) {
  controller_.uses_a_nonce = 2;
  RwsHttp http(access());
  for (int i = 0; i < 6; ++i) {
    const auto reply = http.exchange({"GET", "/rw/system?json=1", "", ""});
    ASSERT_TRUE(reply.ok()) << reply.error().text();
    EXPECT_EQ(reply->status, 200);
  }
  EXPECT_GE(http.counters().challenges, 3u);
}

TEST_F(RwsHttpTest, AWrongPasswordIsTriedOnceAndNeverShown) {
  RwsAccess wrong = access();
  wrong.password = "geheim-4711";
  RwsHttp http(wrong);
  const auto reply = http.exchange({"GET", "/rw/system?json=1", "", ""});
  ASSERT_FALSE(reply.ok());
  EXPECT_EQ(reply.error().code, "http.refused");
  EXPECT_NE(reply.error().what.find(kUser), std::string::npos);
  EXPECT_EQ(reply.error().text().find("geheim"), std::string::npos);
  EXPECT_EQ(controller_.log.size(), 2u) << "more would lock the account";
}

TEST_F(RwsHttpTest, AnotherSchemeIsNamed) {
  controller_.scheme = "Basic";
  RwsHttp http(access());
  const auto reply = http.exchange({"GET", "/rw/system?json=1", "", ""});
  ASSERT_FALSE(reply.ok());
  EXPECT_EQ(reply.error().code, "http.refused");
  EXPECT_NE(reply.error().mend.find("RWS 1.0"), std::string::npos);
}

TEST_F(RwsHttpTest, AFullControllerIsReportedAndCounted) {
  controller_.answer_status = 503;
  RwsAccess patient = access();
  patient.overload_pause = kMillisecond;
  RwsHttp http(patient);
  const auto reply = http.exchange({"GET", "/rw/system?json=1", "", ""});
  ASSERT_TRUE(reply.ok());
  EXPECT_EQ(reply->status, 503);
  EXPECT_EQ(http.counters().overloads, 3u) << "asked again twice";
  EXPECT_EQ(RwsClient(http).stop().error().code, "rws.overloaded");
}

TEST_F(RwsHttpTest, NoContentIsAnAnswer) {
  controller_.answer_status = 204;
  RwsHttp http(access());
  EXPECT_TRUE(RwsClient(http).set_motors(true).ok());
  EXPECT_EQ(controller_.last_body, "ctrl-state=motoron");
}

TEST_F(RwsHttpTest, AFileGoesUpByteForByte) {
  RwsHttp http(access());
  std::string module;
  for (int i = 0; i < 200'000; ++i) module += static_cast<char>('A' + i % 26);
  const auto reply = http.exchange({"PUT", "/fileservice/$home/weldcell/job.mod", module, "text/plain"});
  ASSERT_TRUE(reply.ok()) << reply.error().text();
  EXPECT_EQ(controller_.last_body, module);
  EXPECT_EQ(controller_.last_type, "text/plain");
  EXPECT_EQ(controller_.log.back(), "PUT /fileservice/$home/weldcell/job.mod 200") << "the $ is literal";
}

TEST_F(RwsHttpTest, RequestsStartNoCloserThanTheLeastInterval) {
  RwsAccess paced = access();
  paced.least_interval = 55 * kMillisecond;
  paced.burst = 1;
  // Five starts, four intervals, on the asking side's clock: a slow machine only makes them longer.
  const auto begin = std::chrono::steady_clock::now();
  RwsHttp http(paced);
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(http.exchange({"GET", "/rw/system?json=1", "", ""}).ok());
  const auto taken = std::chrono::steady_clock::now() - begin;
  ASSERT_EQ(controller_.starts.size(), 5u);
  EXPECT_GE(taken, std::chrono::milliseconds(4 * 55));
}

TEST_F(RwsHttpTest, SilenceIsATimeout) {
  RwsAccess hasty = access();
  hasty.timeout = 200 * kMillisecond;
  RwsHttp http(hasty);
  ASSERT_TRUE(http.exchange({"GET", "/rw/system?json=1", "", ""}).ok());
  controller_.silent_ms = 600;
  const auto reply = http.exchange({"GET", "/rw/system?json=1", "", ""});
  ASSERT_FALSE(reply.ok());
  EXPECT_EQ(reply.error().code, "http.timeout");
  {
    const std::lock_guard lock(controller_.mutex);
    controller_.silent_ms = 0;
  }
  EXPECT_TRUE(http.exchange({"GET", "/rw/system?json=1", "", ""}).ok()) << "and the next one is served";
}

TEST_F(RwsHttpTest, AClosedConnectionIsOpenedAgain) {
  controller_.close_after_answer = true;
  RwsHttp http(access());
  for (int i = 0; i < 3; ++i) {
    const auto reply = http.exchange({"GET", "/rw/system?json=1", "", ""});
    ASSERT_TRUE(reply.ok()) << reply.error().text();
  }
}

TEST_F(RwsHttpTest, LogoutFreesTheSession) {
  {
    RwsHttp http(access());
    ASSERT_TRUE(http.exchange({"GET", "/rw/system?json=1", "", ""}).ok());
  }
  EXPECT_EQ(controller_.log.back(), "GET /logout 200");
  EXPECT_EQ(controller_.cookies.back(), "-http-session-=4::http.session::abc; ABBCX=1");
}

class RwsSessionFileTest : public RwsHttpTest {
 protected:
  void SetUp() override {
    RwsHttpTest::SetUp();
    std::string pattern = (std::filesystem::temp_directory_path() / "rws-session-XXXXXX").string();
    folder_ = ::mkdtemp(pattern.data());
    kept_ = access();
    kept_.session_file = (folder_ / "rws-session").string();
  }
  void TearDown() override {
    std::filesystem::remove_all(folder_);
    RwsHttpTest::TearDown();
  }
  std::string text() const {
    std::ifstream in(kept_.session_file);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void write(const std::string& what, unsigned mode = 0600) {
    std::ofstream(kept_.session_file, std::ios::trunc) << what;
    std::filesystem::permissions(kept_.session_file, std::filesystem::perms(mode));
  }
  std::string sound() const {
    return "weldcell rws session 1\ncontroller 127.0.0.1:" + std::to_string(server_->port()) + " 1\na=b\n";
  }
  std::filesystem::path folder_;
  RwsAccess kept_;
};

TEST_F(RwsSessionFileTest, LiesThereFromLoginToLogoutForNobodyElse) {
  RwsHttp http(kept_);
  EXPECT_FALSE(http.has_former_session());
  ASSERT_TRUE(http.exchange({"GET", "/rw/system?json=1", "", ""}).ok());
  EXPECT_NE(text().find("-http-session-=4::http.session::abc\n"), std::string::npos) << text();
  EXPECT_EQ(text().find(kPassword), std::string::npos);
  EXPECT_EQ(std::filesystem::status(kept_.session_file).permissions(), std::filesystem::perms(0600));
  ASSERT_TRUE(http.exchange({"GET", "/rw/system?json=1", "", ""}).ok());
  EXPECT_NE(text().find("ABBCX=2\n"), std::string::npos) << "the newest of each: " << text();
  RwsHttp next(kept_);
  ++controller_.nonce;  // another client counts its uses of a nonce anew
  EXPECT_TRUE(next.has_former_session());
  EXPECT_EQ(next.cookie_header(), http.cookie_header());
  EXPECT_TRUE(next.logout().ok());
  EXPECT_EQ(controller_.log.back(), "GET /logout 200");
  EXPECT_FALSE(next.has_former_session());
  EXPECT_FALSE(std::filesystem::exists(kept_.session_file));
}

TEST_F(RwsSessionFileTest, IsKeptWhereNobodyAnswersTheLogout) {
  write(sound());
  controller_.answer_status = 503;
  kept_.overload_pause = kMillisecond;
  EXPECT_EQ(RwsHttp(kept_).logout().error().code, "http.overloaded");
  EXPECT_TRUE(std::filesystem::exists(kept_.session_file));
  server_->stopAll(true);
  server_ = nullptr;
  EXPECT_FALSE(RwsHttp(kept_).logout().ok());
  EXPECT_TRUE(RwsHttp(kept_).has_former_session());
  RwsHttpTest::SetUp();
}

TEST_F(RwsSessionFileTest, AnythingElseThanItsOwnIsNotSent) {
  write(sound());
  EXPECT_TRUE(RwsHttp(kept_).has_former_session()) << "what the others differ from";
  controller_.log.clear();
  const std::string port = std::to_string(server_->port());
  for (const std::string& other :
       {std::string(), std::string("weldcell rws session 2\ncontroller 127.0.0.1:" + port + " 1\na=b\n"),
        std::string("weldcell rws session 1\ncontroller 127.0.0.2:" + port + " 1\na=b\n"),
        std::string("weldcell rws session 1\ncontroller 127.0.0.1:" + port + " 2\na=b\n"),
        sound() + "no equals\n", sound() + "a=b\rEvil: header\n", sound() + "=b\n"}) {
    write(other);
    EXPECT_FALSE(RwsHttp(kept_).has_former_session()) << other;
  }
  write(sound(), 0640);
  EXPECT_FALSE(RwsHttp(kept_).has_former_session()) << "a group may read it";
  write(sound());
  std::filesystem::rename(kept_.session_file, folder_ / "elsewhere");
  std::filesystem::create_symlink(folder_ / "elsewhere", kept_.session_file);
  EXPECT_FALSE(RwsHttp(kept_).has_former_session()) << "a link";
  EXPECT_TRUE(controller_.log.empty()) << "nothing was sent";
}

TEST_F(RwsSessionFileTest, AFolderThatCannotBeWrittenIsToldOnce) {
  kept_.session_file = (folder_ / "missing/rws-session").string();
  RwsHttp http(kept_);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(http.exchange({"GET", "/rw/system?json=1", "", ""}).ok());
  const auto fault = http.take_session_fault();
  ASSERT_TRUE(fault);
  EXPECT_EQ(fault->code, "rws.session_file");
  EXPECT_EQ(fault->text().find("abc"), std::string::npos) << "no cookie in a message";
  EXPECT_FALSE(http.take_session_fault());
}

TEST_F(RwsHttpTest, NobodyThereIsUnreachable) {
  RwsAccess nowhere = access();
  server_->stopAll(true);
  server_ = nullptr;
  RwsHttp http(nowhere);
  const auto reply = http.exchange({"GET", "/rw/system?json=1", "", ""});
  ASSERT_FALSE(reply.ok());
  EXPECT_EQ(reply.error().code, "http.unreachable");
  SetUp();
}

}  // namespace
}  // namespace weldcell::adapters
