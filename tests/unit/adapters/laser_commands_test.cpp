// The talk over a TCP command port against a scripted sensor on loopback.
#include "weldcell/adapters/laser_commands.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <thread>

#include "weldcell/adapters/fd.hpp"

namespace weldcell::adapters {
namespace {

using testing::HasSubstr;

/// Takes one client and answers `answers` in turn, one for each piece heard, then goes silent or hangs up.
class CommandPort {
 public:
  CommandPort(std::vector<std::string> answers, bool hang_up) : listener_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in local{};
    local.sin_family = AF_INET;
    local.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::bind(listener_.get(), reinterpret_cast<sockaddr*>(&local), sizeof local), 0);
    EXPECT_EQ(::listen(listener_.get(), 1), 0);
    socklen_t size = sizeof local;
    ::getsockname(listener_.get(), reinterpret_cast<sockaddr*>(&local), &size);
    port_ = ntohs(local.sin_port);
    thread_ = std::thread([this, answers = std::move(answers), hang_up] {
      const Fd client(::accept(listener_.get(), nullptr, nullptr));
      char heard[256];
      for (const std::string& answer : answers) {
        if (::recv(client.get(), heard, sizeof heard, 0) <= 0) return;
        if (::send(client.get(), answer.data(), answer.size(), MSG_NOSIGNAL) < 0) return;
      }
      while (!hang_up && ::recv(client.get(), heard, sizeof heard, 0) > 0) continue;
      if (hang_up) ::recv(client.get(), heard, sizeof heard, 0);
    });
  }
  ~CommandPort() { thread_.join(); }
  int port() const { return port_; }

 private:
  Fd listener_;
  int port_ = 0;
  std::thread thread_;
};

wire::LaserWanted wanted() {
  wire::LaserWanted out;
  out.format.dialect = wire::LaserDialect::Meas32;
  out.format.range_mm = 2;
  out.format.rate_hz = 1e6 / 480;
  return out;
}

TEST(LaserCommands, ASensorThatFitsHasItsNotesReturned) {
  CommandPort sensor({"$CHS1,0,0,0OK\r\n", "$CHI1:ANO1,NAMDL6220,SNO1,OFS0,RNG2000,UNTum,DTY1OK\r\n",
                      "$STI?480OK\r\n", "$AVT?0OK\r\n"},
                     true);
  int beats = 0;
  const auto notes = set_up_laser("127.0.0.1", sensor.port(), wanted(), {kSecond, 1, [&beats] { ++beats; }});
  ASSERT_TRUE(notes.ok()) << notes.error().text();
  EXPECT_EQ(notes->size(), 1U);
  EXPECT_EQ(beats, 4);
}

TEST(LaserCommands, AMismatchNamesTheDevice) {
  CommandPort sensor({"$CHS1,0,0,0OK\r\n", "$CHI1:ANO1,NAMDL6220,SNO1,OFS0,RNG500,UNTum,DTY1OK\r\n",
                      "$STI?480OK\r\n", "$AVT?0OK\r\n"},
                     true);
  const auto notes = set_up_laser("127.0.0.1", sensor.port(), wanted(), {kSecond, 1, {}});
  ASSERT_FALSE(notes.ok());
  EXPECT_EQ(notes.error().code, "laser.mismatch");
  EXPECT_THAT(notes.error().text(), HasSubstr("laser 127.0.0.1:" + std::to_string(sensor.port()) +
                                              " (DL6220, channel 1): laser.range_mm is 2, the sensor has "
                                              "0.5 mm"));
}

TEST(LaserCommands, SilenceAHangUpAndAClosedPortAreToldWithTheWayOut) {
  int closed_port = 0;
  {
    CommandPort silent({"$CHS1,0,0,0OK\r\n"}, false);
    const auto timeout = set_up_laser("127.0.0.1", silent.port(), wanted(), {30 * kMillisecond, 2, {}});
    EXPECT_EQ(timeout.error().code, "laser.timeout");
    EXPECT_THAT(timeout.error().text(), HasSubstr("no answer to '$CHI1'"));
    EXPECT_THAT(timeout.error().text(), HasSubstr("laser.command_port: none"));
    closed_port = silent.port();
  }
  CommandPort rude({"$CHS1,0,0,0OK\r\n"}, true);
  const auto closed = set_up_laser("127.0.0.1", rude.port(), wanted(), {kSecond, 1, {}});
  EXPECT_THAT(closed.error().text(), HasSubstr("closed the connection at '$CHI1'"));
  const auto refused = set_up_laser("127.0.0.1", closed_port, wanted(), {kSecond, 1, {}});
  EXPECT_EQ(refused.error().code, "laser.refused");
  EXPECT_THAT(refused.error().text(), HasSubstr("command port: "));
}

}  // namespace
}  // namespace weldcell::adapters
