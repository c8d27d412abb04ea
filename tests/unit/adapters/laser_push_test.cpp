// The push link against a scripted sensor on loopback, from the manual's bytes.
#include "weldcell/adapters/laser_push.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <array>
#include <string>
#include <thread>
#include <vector>

#include "weldcell/adapters/host_clock.hpp"

namespace weldcell::adapters {
namespace {

/// A sensor of so many channels at 10 kHz, no filter on.
wire::LaserFormat format(std::size_t channels) {
  wire::LaserFormat out;
  out.dialect = wire::LaserDialect::Od5000;
  out.rate_hz = 10'000;
  out.words = channels;
  return out;
}

/// Answers a number of commands on a thread of its own: a write with `reply`, a read with the setting that is
/// wanted.
class Sensor {
 public:
  explicit Sensor(std::string reply, int commands) : socket_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in local{};
    local.sin_family = AF_INET;
    local.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::bind(socket_.get(), reinterpret_cast<sockaddr*>(&local), sizeof local), 0);
    socklen_t n = sizeof local;
    ::getsockname(socket_.get(), reinterpret_cast<sockaddr*>(&local), &n);
    port_ = ntohs(local.sin_port);
    const timeval limit{5, 0};
    ::setsockopt(socket_.get(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    thread_ = std::thread([this, reply, commands] {
      for (int i = 0; i < commands; ++i) {
        std::array<char, 100> buffer{};
        sockaddr_in from{};
        socklen_t size = sizeof from;
        const ssize_t got = ::recvfrom(socket_.get(), buffer.data(), buffer.size(), 0,
                                       reinterpret_cast<sockaddr*>(&from), &size);
        if (got < 0) return;
        heard_.emplace_back(buffer.data(), static_cast<std::size_t>(got));
        std::string answer = reply;
        if (heard_.back()[0] == '\x30') {
          const char value = heard_.back()[3] == '\x10' && heard_.back()[2] == '\x0C' ? '\x03'
                             : heard_.back()[3] == '\x14'                             ? '\x01'
                                                                                      : '\x00';
          answer = std::string("\xB0\x04\x00\x00\x00", 5) + value;
        }
        ::sendto(socket_.get(), answer.data(), answer.size(), 0, reinterpret_cast<sockaddr*>(&from), size);
      }
    });
  }
  ~Sensor() {
    if (thread_.joinable()) thread_.join();
  }
  int port() const { return port_; }
  const std::vector<std::string>& heard() {
    thread_.join();
    return heard_;
  }
  void push(int port, const std::string& bytes) const {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ASSERT_EQ(
        ::sendto(socket_.get(), bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof to),
        static_cast<ssize_t>(bytes.size()));
  }

 private:
  Fd socket_;
  int port_ = 0;
  std::thread thread_;
  std::vector<std::string> heard_;
};

const std::string kDone("\xC0\x00", 2);

TEST(LaserPush, WritesAddressPortAndChannelsThenReceives) {
  Sensor sensor(kDone, 8);
  auto link = LaserPush::start("127.0.0.1", sensor.port(), "127.0.0.1", 0, format(2), kSecond);
  ASSERT_TRUE(link.ok()) << link.error().text();
  const auto& heard = sensor.heard();
  ASSERT_EQ(heard.size(), 8U);
  EXPECT_TRUE(link->notes().empty());
  EXPECT_EQ(heard[0], std::string("\x40\x02\x01\xE0\x00\x04\x00\x00\x00\x00", 10));
  EXPECT_EQ(heard[1], std::string("\x30\x02\x0C\x10", 4));
  EXPECT_EQ(heard[5], std::string("\x40\x02\x10\xE4\x00\x04\x7F\x00\x00\x01", 10));
  const std::string port{static_cast<char>(link->port() >> 8), static_cast<char>(link->port() & 0xFF)};
  EXPECT_EQ(heard[6], std::string("\x40\x02\x10\xE2\x00\x02", 6) + port);
  EXPECT_EQ(heard[7], std::string("\x40\x02\x01\xE0\x00\x04\x00\x00\x00\x03", 10));

  std::array<std::byte, 64> buffer{};
  EXPECT_EQ(link->receive(buffer, 10 * kMillisecond).event, LinkEvent::Timeout);
  const HostTime before = now();
  sensor.push(link->port(), "one");
  sensor.push(link->port(), std::string(100, 'x'));  // longer than the buffer
  sensor.push(link->port(), "three");
  const LaserArrival one = link->receive(buffer, kSecond);
  ASSERT_EQ(one.event, LinkEvent::Data);
  EXPECT_EQ(one.bytes, 3U);
  EXPECT_GE(one.arrival, before - 50 * kMicrosecond);
  EXPECT_EQ(link->receive(buffer, kSecond).bytes, 5U);
  EXPECT_EQ(link->foreign(), 1U);
}

TEST(LaserPush, SaysWhatTheSensorDidNotDo) {
  Sensor refusing(std::string("\xC0\x02\x00\xE1", 4), 1);
  const auto refused = LaserPush::start("127.0.0.1", refusing.port(), "127.0.0.1", 0, format(1), kSecond);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, "laser.refused");
  EXPECT_NE(refused.error().text().find("0x01E0"), std::string::npos);

  int closed_port = 0;
  { closed_port = Sensor(kDone, 0).port(); }
  EXPECT_EQ(
      LaserPush::start("127.0.0.1", closed_port, "127.0.0.1", 0, format(1), 50 * kMillisecond).error().code,
      "laser.refused");
  EXPECT_EQ(LaserPush::start("sensor", 5011, "127.0.0.1", 0, format(1), kSecond).error().code,
            "laser.address");
  EXPECT_EQ(LaserPush::start("127.0.0.1", 5011, "here", 0, format(1), kSecond).error().code, "laser.address");
  EXPECT_EQ(LaserPush::start("127.0.0.1", 5011, "192.0.2.1", 0, format(1), kSecond).error().code,
            "laser.listen");
}

TEST(LaserPush, ASecondWithoutReadingsIsALoss) {
  Sensor sensor(kDone, 8);
  auto link = LaserPush::start("127.0.0.1", sensor.port(), "127.0.0.1", 0, format(1), kSecond);
  ASSERT_TRUE(link.ok());
  std::array<std::byte, 64> buffer{};
  EXPECT_EQ(link->reason(), "");
  EXPECT_EQ(link->receive(buffer, 1100 * kMillisecond).event, LinkEvent::Closed);
  EXPECT_NE(link->reason().find("no readings"), std::string::npos);
}

}  // namespace
}  // namespace weldcell::adapters
