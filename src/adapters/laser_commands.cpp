#include "weldcell/adapters/laser_commands.hpp"

#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "socket_stamp.hpp"
#include "weldcell/adapters/host_clock.hpp"
#include "weldcell/adapters/laser_tcp.hpp"

namespace weldcell::adapters {
namespace {

enum class Outcome { Answered, Silent, Closed, NobodyThere };

std::string printable(const std::string& request) {
  std::string out;
  for (const char c : request) {
    if (c >= 0x20 && c < 0x7F) out += c;
  }
  return out;
}

bool refused(ssize_t n) { return n < 0 && errno == ECONNREFUSED; }

Outcome ask(int fd, const std::string& request, wire::LaserSetup& setup, Nanoseconds timeout) {
  const ssize_t sent = ::send(fd, request.data(), request.size(), MSG_NOSIGNAL);
  if (refused(sent)) return Outcome::NobodyThere;
  if (sent != static_cast<ssize_t>(request.size())) return Outcome::Closed;
  const HostTime deadline = now() + timeout;
  std::array<char, 2048> buffer;
  while (wait_readable(fd, deadline)) {
    const ssize_t n = ::recv(fd, buffer.data(), buffer.size(), 0);
    if (refused(n)) return Outcome::NobodyThere;
    if (n == 0) return Outcome::Closed;
    if (n < 0 && errno != EAGAIN && errno != EINTR) return Outcome::Closed;
    if (n > 0 && setup.take({buffer.data(), static_cast<std::size_t>(n)})) return Outcome::Answered;
    // A stream of readings must not hold the talk for ever.
    if (now() >= deadline) return Outcome::Silent;
  }
  return Outcome::Silent;
}

constexpr const char* kMend =
    "check cable, power and laser.command_port; if the sensor's commands cannot be reached, set it by hand "
    "and "
    "write laser.command_port: none";

}  // namespace

Result<std::vector<std::string>> talk_to_laser(int fd, const std::string& device, wire::LaserSetup& setup,
                                               const TalkLimits& limits) {
  for (std::string request = setup.request(); !request.empty(); request = setup.request()) {
    if (limits.beat) limits.beat();
    Outcome outcome = Outcome::Silent;
    for (int i = 0; i < limits.tries && outcome == Outcome::Silent; ++i)
      outcome = ask(fd, request, setup, limits.answer);
    if (outcome == Outcome::Answered) continue;
    if (outcome == Outcome::NobodyThere)
      return Error{"laser.refused", device, "the host is there, but nothing takes commands at this port",
                   kMend};
    const std::string asked = printable(request);
    return Error{"laser.timeout", device,
                 (outcome == Outcome::Closed ? "the sensor closed the connection at " : "no answer to ") +
                     (asked.empty() ? "a command" : "'" + asked + "'"),
                 kMend};
  }
  if (const auto fault = setup.fault()) return *fault;
  return setup.notes();
}

Result<std::vector<std::string>> set_up_laser(const std::string& host, int command_port,
                                              wire::LaserWanted wanted, const TalkLimits& limits) {
  auto link = LaserSocket::connect(host, command_port, kSecond);
  if (!link.ok()) {
    Error error = link.error();
    error.what = "command port: " + error.what;
    error.mend = kMend;
    return error;
  }
  wanted.device = "laser " + host + ":" + std::to_string(command_port);
  const auto setup = wire::laser_setup(wanted);
  return talk_to_laser(link->fd(), wanted.device, *setup, limits);
}

}  // namespace weldcell::adapters
