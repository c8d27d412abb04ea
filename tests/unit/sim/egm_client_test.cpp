// The simulated controller's UDP side: it speaks first, from one port of its own, and hears its peer only.
#include "sim/egm_client.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace weldcell::sim {
namespace {

/// A PC that waits on a port of the loopback.
struct Pc {
  explicit Pc(const char* host = "127.0.0.1") : fd(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in local{};
    local.sin_family = AF_INET;
    ::inet_pton(AF_INET, host, &local.sin_addr);
    EXPECT_EQ(::bind(fd, reinterpret_cast<sockaddr*>(&local), sizeof local), 0);
    socklen_t size = sizeof local;
    ::getsockname(fd, reinterpret_cast<sockaddr*>(&local), &size);
    port = ntohs(local.sin_port);
  }
  ~Pc() { ::close(fd); }
  sockaddr_in hear() {
    char buffer[64];
    sockaddr_in from{};
    socklen_t size = sizeof from;
    EXPECT_GT(::recvfrom(fd, buffer, sizeof buffer, 0, reinterpret_cast<sockaddr*>(&from), &size), 0);
    return from;
  }
  void say(const sockaddr_in& to, const char* word) const {
    EXPECT_EQ(::sendto(fd, word, 1, 0, reinterpret_cast<const sockaddr*>(&to), sizeof to), 1);
  }
  int fd, port = 0;
};

/// The first byte that the controller hears; ' ' when it hears nothing.
char heard(EgmClient& controller) {
  const auto got = controller.receive();
  return got ? static_cast<char>((*got)[0]) : ' ';
}

TEST(EgmClient, SpeaksFirstAndAlwaysFromOnePort) {
  Pc pc;
  EgmClient controller({"127.0.0.1", pc.port});
  EXPECT_EQ(heard(controller), ' ');
  const std::byte word[1] = {std::byte{'x'}};
  ASSERT_TRUE(controller.send(word));
  const sockaddr_in first = pc.hear();
  ASSERT_TRUE(controller.send(word));
  EXPECT_EQ(pc.hear().sin_port, first.sin_port);
  pc.say(first, "a");
  EXPECT_EQ(heard(controller), 'a');
}

TEST(EgmClient, HearsNobodyButTheConfiguredPeer) {
  Pc pc, other, elsewhere("127.0.0.2");
  EgmClient controller({"127.0.0.1", pc.port});
  const std::byte word[1] = {std::byte{'x'}};
  ASSERT_TRUE(controller.send(word));
  const sockaddr_in at = pc.hear();
  other.say(at, "b");
  elsewhere.say(at, "c");
  EXPECT_EQ(heard(controller), ' ');
  other.say(at, "d");
  pc.say(at, "e");
  EXPECT_EQ(heard(controller), 'e') << "what others said before is gone";
}

}  // namespace
}  // namespace weldcell::sim
