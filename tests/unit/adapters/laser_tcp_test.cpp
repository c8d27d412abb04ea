// The laser link against a TCP server on loopback.
#include "weldcell/adapters/laser_tcp.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <array>
#include <string>
#include <thread>

#include "weldcell/adapters/host_clock.hpp"

namespace weldcell::adapters {
namespace {

class Sensor {
 public:
  Sensor() : listener_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in local{};
    local.sin_family = AF_INET;
    local.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::bind(listener_.get(), reinterpret_cast<sockaddr*>(&local), sizeof local), 0);
    EXPECT_EQ(::listen(listener_.get(), 4), 0);
    socklen_t n = sizeof local;
    ::getsockname(listener_.get(), reinterpret_cast<sockaddr*>(&local), &n);
    port_ = ntohs(local.sin_port);
  }
  int port() const { return port_; }
  void accept() { client_ = Fd(::accept(listener_.get(), nullptr, nullptr)); }
  void send(const std::string& text) const {
    ASSERT_EQ(::send(client_.get(), text.data(), text.size(), 0), static_cast<ssize_t>(text.size()));
  }
  void close() { client_.reset(); }
  void reset() {
    const linger hard{1, 0};
    ::setsockopt(client_.get(), SOL_SOCKET, SO_LINGER, &hard, sizeof hard);
    client_.reset();
  }

 private:
  Fd listener_, client_;
  int port_ = 0;
};

TEST(LaserSocket, ReceivesWithTheKernelsStamp) {
  Sensor sensor;
  auto link = LaserSocket::connect("127.0.0.1", sensor.port(), kSecond);
  ASSERT_TRUE(link.ok()) << link.error().text();
  sensor.accept();
  std::array<std::byte, 64> buffer{};
  Nanoseconds behind_sending = kSecond;
  for (int i = 0; i < 20 && behind_sending > kMillisecond; ++i) {
    const HostTime before = now();
    sensor.send("MEAS");
    const HostTime sent = now();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    const LaserArrival got = link->receive(buffer, kSecond);
    ASSERT_EQ(got.event, LinkEvent::Data);
    ASSERT_EQ(got.bytes, 4u);
    ASSERT_GE(got.arrival, before - 50 * kMicrosecond);
    behind_sending = got.arrival - sent;
  }
  EXPECT_LE(behind_sending, kMillisecond);
  EXPECT_TRUE(link->kernel_stamps());
  EXPECT_EQ(link->reason(), "");
}

TEST(LaserSocket, SilenceIsNoLoss) {
  Sensor sensor;
  auto link = LaserSocket::connect("127.0.0.1", sensor.port(), kSecond);
  ASSERT_TRUE(link.ok());
  sensor.accept();
  std::array<std::byte, 64> buffer{};
  EXPECT_EQ(link->receive(buffer, 10 * kMillisecond).event, LinkEvent::Timeout);
  sensor.send("x");
  EXPECT_EQ(link->receive(buffer, kSecond).event, LinkEvent::Data);
}

TEST(LaserSocket, TellsACloseAfterTheLastBytes) {
  Sensor sensor;
  auto link = LaserSocket::connect("127.0.0.1", sensor.port(), kSecond);
  ASSERT_TRUE(link.ok());
  sensor.accept();
  sensor.send("last");
  sensor.close();
  std::array<std::byte, 64> buffer{};
  EXPECT_EQ(link->receive(buffer, kSecond).bytes, 4u);
  EXPECT_EQ(link->receive(buffer, kSecond).event, LinkEvent::Closed);
  EXPECT_NE(link->reason().find("the sensor closed the connection"), std::string::npos);
  EXPECT_NE(link->reason().find(std::to_string(sensor.port())), std::string::npos);
}

TEST(LaserSocket, TellsAReset) {
  Sensor sensor;
  auto link = LaserSocket::connect("127.0.0.1", sensor.port(), kSecond);
  ASSERT_TRUE(link.ok());
  sensor.accept();
  sensor.reset();
  std::array<std::byte, 64> buffer{};
  EXPECT_EQ(link->receive(buffer, kSecond).event, LinkEvent::Failed);
  EXPECT_NE(link->reason().find("reset"), std::string::npos) << link->reason();
}

TEST(LaserSocket, SaysWhyItCannotConnect) {
  int free_port = 0;
  { free_port = Sensor().port(); }
  auto refused = LaserSocket::connect("127.0.0.1", free_port, kSecond);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, "laser.refused");
  EXPECT_EQ(LaserSocket::connect("sensor", 1, kSecond).error().code, "laser.address");
  EXPECT_EQ(LaserSocket::connect("127.0.0.1", 0, kSecond).error().code, "laser.address");
}

}  // namespace
}  // namespace weldcell::adapters
