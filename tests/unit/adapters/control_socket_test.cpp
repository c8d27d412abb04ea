// The control socket: a client of the command line, a rude client, and a daemon that is not there.
#include "weldcell/adapters/control_socket.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <optional>
#include <thread>
#include <vector>

#include "weldcell/adapters/fd.hpp"

namespace weldcell::adapters {
namespace {

namespace fs = std::filesystem;

class Control : public ::testing::Test {
 protected:
  void SetUp() override {
    char name[] = "/tmp/weldcell-control-XXXXXX";
    ASSERT_NE(::mkdtemp(name), nullptr);
    folder_ = name;
    path_ = folder_ / "weldcelld.sock";
  }
  void TearDown() override {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
    server_.reset();
    fs::remove_all(folder_);
  }
  void serve() {
    auto server = ControlSocket::listen(path_, [](const ControlRequest& r) {
      return "{\"ok\":true,\n\"command\":\"" + r.command + "\",\"uid\":" + std::to_string(r.peer_uid) + "}";
    });
    ASSERT_TRUE(server.ok()) << server.error().text();
    server_.emplace(std::move(server).value());
    thread_ = std::thread([this] {
      while (!stop_) server_->poll(10 * kMillisecond);
    });
  }
  Fd connect() const {
    Fd fd(::socket(AF_UNIX, SOCK_STREAM, 0));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.native().copy(address.sun_path, sizeof address.sun_path - 1);
    EXPECT_EQ(::connect(fd.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    timeval limit{5, 0};
    ::setsockopt(fd.get(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    return fd;
  }
  static std::string read_all(const Fd& fd) {
    std::string out;
    char piece[4096];
    for (ssize_t n; (n = ::recv(fd.get(), piece, sizeof piece, 0)) > 0;)
      out.append(piece, static_cast<std::size_t>(n));
    return out;
  }

  fs::path folder_, path_;
  std::optional<ControlSocket> server_;
  std::thread thread_;
  std::atomic<bool> stop_{false};
};

TEST_F(Control, AnswersOneLineForOneLine) {
  serve();
  const auto answer = control_request(path_, R"({"command":"status"})", 5 * kSecond);
  ASSERT_TRUE(answer.ok()) << answer.error().text();
  EXPECT_EQ(*answer, R"({"ok":true, "command":"status","uid":)" + std::to_string(::getuid()) + "}");
  struct stat facts {};
  ASSERT_EQ(::stat(path_.c_str(), &facts), 0);
  EXPECT_EQ(facts.st_mode & 0777, 0660u);
}

TEST_F(Control, WhatIsNoRequestIsRefusedInWords) {
  serve();
  for (const char* line : {"hello", "[1]", "{\"command\":5}", "{}", "{\"command\":"}) {
    const auto answer = control_request(path_, line, 5 * kSecond);
    ASSERT_TRUE(answer.ok()) << line;
    EXPECT_NE(answer->find("\"ok\":false"), std::string::npos) << line << " " << *answer;
  }
}

TEST_F(Control, TwoRequestsInOnePacketAndOneInPieces) {
  serve();
  const Fd fd = connect();
  const std::string two = "{\"command\":\"a\"}\n\n{\"command\":\"b\"}\n{\"comm";
  ASSERT_EQ(::send(fd.get(), two.data(), two.size(), 0), static_cast<ssize_t>(two.size()));
  ::usleep(20'000);
  const std::string rest = "and\":\"c\"}\n";
  ASSERT_EQ(::send(fd.get(), rest.data(), rest.size(), 0), static_cast<ssize_t>(rest.size()));
  ::shutdown(fd.get(), SHUT_WR);
  const std::string all = read_all(fd);
  EXPECT_NE(all.find("\"a\""), std::string::npos);
  EXPECT_NE(all.find("\"b\""), std::string::npos);
  EXPECT_NE(all.find("\"c\""), std::string::npos) << all;
}

TEST_F(Control, AnEndlessLineIsCutOff) {
  serve();
  const Fd fd = connect();
  const std::string piece(4096, 'x');
  for (int i = 0; i < 40; ++i)
    if (::send(fd.get(), piece.data(), piece.size(), MSG_NOSIGNAL) < 0) break;
  // The rest in flight makes the close a reset; the answer may be lost with it, the daemon is not.
  read_all(fd);
  EXPECT_TRUE(control_request(path_, R"({"command":"status"})", 5 * kSecond).ok());
}

TEST_F(Control, TheNinthClientIsToldToWait) {
  serve();
  std::vector<Fd> clients;
  for (int i = 0; i < kControlClients; ++i) {
    clients.push_back(connect());
    ASSERT_EQ(::send(clients.back().get(), "{\"command\":\"a\"}\n", 16, 0), 16);
    char c = 0;
    ASSERT_EQ(::recv(clients.back().get(), &c, 1, 0), 1);
  }
  EXPECT_NE(read_all(connect()).find("too many clients"), std::string::npos);
  clients.pop_back();
  ::usleep(50'000);
  EXPECT_TRUE(control_request(path_, R"({"command":"status"})", 5 * kSecond).ok());
}

TEST_F(Control, AStaleSocketIsReplacedAndALivingOneIsNot) {
  serve();
  EXPECT_EQ(ControlSocket::listen(path_, {}).error().code, "control.in_use");
  stop_ = true;
  thread_.join();
  server_.reset();
  {
    const Fd dead(::socket(AF_UNIX, SOCK_STREAM, 0));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.native().copy(address.sun_path, sizeof address.sun_path - 1);
    ASSERT_EQ(::bind(dead.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  EXPECT_EQ(control_request(path_, "{}", kSecond).error().code, "control.no_daemon");
  EXPECT_TRUE(ControlSocket::listen(path_, {}).ok());
}

TEST_F(Control, SaysWhatIsWrong) {
  const auto absent = control_request(path_, "{}", kSecond);
  ASSERT_FALSE(absent.ok());
  EXPECT_EQ(absent.error().code, "control.no_daemon");
  EXPECT_NE(absent.error().mend.find("start weldcelld"), std::string::npos);
  EXPECT_EQ(ControlSocket::listen(fs::path(std::string(200, 'x')), {}).error().code, "control.path");
  EXPECT_EQ(ControlSocket::listen(folder_ / "none" / "s", {}).error().code, "control.path");
  std::ofstream(folder_ / "file") << "keep me";
  EXPECT_EQ(ControlSocket::listen(folder_ / "file", {}).error().code, "control.path");
  auto deaf = ControlSocket::listen(path_, {});
  ASSERT_TRUE(deaf.ok());
  EXPECT_EQ(control_request(path_, "{}", 100 * kMillisecond).error().code, "control.timeout");
}

}  // namespace
}  // namespace weldcell::adapters
