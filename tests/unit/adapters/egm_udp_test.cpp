// The EGM socket against real datagrams on loopback.
#include "weldcell/adapters/egm_udp.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <cstring>
#include <string>
#include <thread>

#include "weldcell/adapters/host_clock.hpp"

namespace weldcell::adapters {
namespace {

/// A controller: a UDP socket of its own port that sends to the daemon's.
class Sender {
 public:
  explicit Sender(int to_port, const char* from = "127.0.0.1") : fd_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in local{};
    local.sin_family = AF_INET;
    inet_pton(AF_INET, from, &local.sin_addr);
    EXPECT_EQ(::bind(fd_.get(), reinterpret_cast<sockaddr*>(&local), sizeof local), 0);
    to_.sin_family = AF_INET;
    to_.sin_port = htons(static_cast<std::uint16_t>(to_port));
    inet_pton(AF_INET, "127.0.0.1", &to_.sin_addr);
  }
  void send(const std::string& text) const {
    ASSERT_EQ(
        ::sendto(fd_.get(), text.data(), text.size(), 0, reinterpret_cast<const sockaddr*>(&to_), sizeof to_),
        static_cast<ssize_t>(text.size()));
  }
  std::string receive() const {
    char buffer[4096];
    timeval limit{2, 0};
    ::setsockopt(fd_.get(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    const ssize_t n = ::recv(fd_.get(), buffer, sizeof buffer, 0);
    return n < 0 ? std::string("nothing") : std::string(buffer, static_cast<std::size_t>(n));
  }

 private:
  Fd fd_;
  sockaddr_in to_{};
};

struct Received {
  std::array<std::byte, kEgmDatagramBytes> buffer{};
  std::string text(const EgmArrival& a) const {
    return {reinterpret_cast<const char*>(buffer.data()), a.bytes};
  }
};

std::span<const std::byte> bytes(const std::string& text) { return std::as_bytes(std::span(text)); }

TEST(EgmSocket, TakesAFreePortAndAnswersTheSender) {
  auto socket = EgmSocket::bind("127.0.0.1", 0);
  ASSERT_TRUE(socket.ok()) << socket.error().text();
  ASSERT_GT(socket->port(), 0);
  EXPECT_FALSE(socket->reply(bytes("too early")));
  const Sender robot(socket->port());
  const HostTime before = now();
  robot.send("feedback");
  Received in;
  const EgmArrival arrival = socket->receive(in.buffer, 2 * kSecond);
  const HostTime after = now();
  ASSERT_TRUE(arrival);
  EXPECT_EQ(in.text(arrival), "feedback");
  // The offset between the clocks is read twice, a microsecond apart.
  EXPECT_GE(arrival.arrival, before - 50 * kMicrosecond);
  EXPECT_LE(arrival.arrival, after);
  EXPECT_TRUE(socket->reply(bytes("command")));
  EXPECT_EQ(robot.receive(), "command");
}

TEST(EgmSocket, StampIsOfTheKernelNotOfTheReading) {
  auto socket = EgmSocket::bind("127.0.0.1", 0);
  ASSERT_TRUE(socket.ok());
  const Sender robot(socket->port());
  Received in;
  // Linux switches its stamps on some time after the option is set; until then it stamps at the reading.
  Nanoseconds behind_sending = kSecond;
  for (int i = 0; i < 20 && behind_sending > kMillisecond; ++i) {
    robot.send("early");
    const HostTime sent = now();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    const EgmArrival arrival = socket->receive(in.buffer, kSecond);
    ASSERT_TRUE(arrival);
    behind_sending = arrival.arrival - sent;
  }
  EXPECT_LE(behind_sending, kMillisecond);
}

TEST(EgmSocket, TimesOutEmpty) {
  auto socket = EgmSocket::bind("127.0.0.1", 0);
  ASSERT_TRUE(socket.ok());
  Received in;
  const HostTime before = now();
  EXPECT_FALSE(socket->receive(in.buffer, 20 * kMillisecond));
  EXPECT_GE(now() - before, 20 * kMillisecond);
}

TEST(EgmSocket, NewestWinsAndTheRestIsCounted) {
  auto socket = EgmSocket::bind("127.0.0.1", 0);
  ASSERT_TRUE(socket.ok());
  const Sender robot(socket->port());
  for (const char* text : {"1", "2", "3", "4"}) robot.send(text);
  Received in;
  const EgmArrival arrival = socket->receive_newest(in.buffer, kSecond);
  EXPECT_EQ(in.text(arrival), "4");
  EXPECT_EQ(socket->counters().superseded, 3u);
  EXPECT_EQ(socket->counters().received, 1u);
}

TEST(EgmSocket, AForeignDatagramBehindTheNewestDoesNotSpoilIt) {
  auto socket = EgmSocket::bind("127.0.0.1", 0);
  ASSERT_TRUE(socket.ok());
  const Sender robot(socket->port());
  const Sender stranger(socket->port());
  robot.send("mine");
  stranger.send("XXXXXXXXXXXX");
  Received in;
  const EgmArrival arrival = socket->receive_newest(in.buffer, kSecond);
  EXPECT_EQ(in.text(arrival), "mine");
  EXPECT_EQ(socket->counters().foreign, 1u);
}

TEST(EgmSocket, FirstSenderIsThePeerUntilForgotten) {
  auto socket = EgmSocket::bind("127.0.0.1", 0);
  ASSERT_TRUE(socket.ok());
  const Sender robot(socket->port());
  const Sender stranger(socket->port());
  Received in;
  robot.send("a");
  ASSERT_TRUE(socket->receive(in.buffer, kSecond));
  stranger.send("b");
  EXPECT_FALSE(socket->receive(in.buffer, 10 * kMillisecond));
  EXPECT_EQ(socket->counters().foreign, 1u);
  ASSERT_TRUE(socket->reply(bytes("still yours")));
  EXPECT_EQ(robot.receive(), "still yours");
  socket->forget_peer();
  stranger.send("c");
  const EgmArrival arrival = socket->receive(in.buffer, kSecond);
  EXPECT_EQ(in.text(arrival), "c");
}

TEST(EgmSocket, ConfiguredPeerIsAnAddressOfAnyPort) {
  auto socket = EgmSocket::bind("127.0.0.1", 0, "127.0.0.2");
  ASSERT_TRUE(socket.ok());
  const Sender stranger(socket->port());
  stranger.send("b");
  Received in;
  EXPECT_FALSE(socket->receive(in.buffer, 10 * kMillisecond));
  const Sender first_session(socket->port(), "127.0.0.2");
  const Sender second_session(socket->port(), "127.0.0.2");
  first_session.send("one");
  EXPECT_EQ(in.text(socket->receive(in.buffer, kSecond)), "one");
  second_session.send("two");
  EXPECT_EQ(in.text(socket->receive(in.buffer, kSecond)), "two");
  ASSERT_TRUE(socket->reply(bytes("to two")));
  EXPECT_EQ(second_session.receive(), "to two");
}

TEST(EgmSocket, EmptyAndOversizeDatagramsAreCountedAndSkipped) {
  auto socket = EgmSocket::bind("127.0.0.1", 0);
  ASSERT_TRUE(socket.ok());
  const Sender robot(socket->port());
  robot.send("");
  robot.send(std::string(kEgmDatagramBytes + 1, 'x'));
  robot.send(std::string(kEgmDatagramBytes, 'y'));
  Received in;
  const EgmArrival arrival = socket->receive(in.buffer, kSecond);
  EXPECT_EQ(arrival.bytes, kEgmDatagramBytes);
  EXPECT_EQ(in.text(arrival)[0], 'y');
  EXPECT_EQ(socket->counters().oversize, 2u);
}

TEST(EgmSocket, SaysWhyItCannotBind) {
  auto first = EgmSocket::bind("127.0.0.1", 0);
  ASSERT_TRUE(first.ok());
  auto second = EgmSocket::bind("127.0.0.1", first->port());
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, "egm.bind");
  EXPECT_NE(second.error().mend.find("another program"), std::string::npos);
  EXPECT_EQ(EgmSocket::bind("robot", 0).error().code, "egm.address");
  EXPECT_EQ(EgmSocket::bind("127.0.0.1", 70000).error().code, "egm.address");
  EXPECT_EQ(EgmSocket::bind("127.0.0.1", 0, "nowhere").error().code, "egm.address");
  EXPECT_EQ(EgmSocket::bind("192.0.2.1", 0).error().code, "egm.bind");
}

TEST(HostClock, ASteppedClockGivesNow) {
  std::timespec old{};
  clock_gettime(CLOCK_REALTIME, &old);
  old.tv_sec -= 100;
  const HostTime before = now();
  EXPECT_GE(from_realtime(old), before);
  old.tv_sec += 200;
  EXPECT_GE(from_realtime(old), before);
  const HostTime taken = from_realtime(old);
  EXPECT_LE(taken, now());
}

TEST(HostClock, WritesUtc) { EXPECT_EQ(utc_text(1769868309999), "2026-01-31T14:05:09Z"); }

}  // namespace
}  // namespace weldcell::adapters
