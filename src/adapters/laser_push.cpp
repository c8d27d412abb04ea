#include "weldcell/adapters/laser_push.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <vector>

#include "socket_stamp.hpp"
#include "weldcell/adapters/host_clock.hpp"

namespace weldcell::adapters {
namespace {

// OD5000, operating instructions 8021391: writing (table 30), data push (table 46).
constexpr std::uint32_t kPushPort = 0x10E2, kPushIp = 0x10E4, kPushChannels = 0x01E0;
constexpr Nanoseconds kSilence = kSecond;
constexpr int kTries = 3;

Error fault(const char* code, const std::string& where, const std::string& what, const char* mend) {
  return {code, "laser " + where, what, mend};
}

bool read_address(const std::string& host, int port, int least_port, sockaddr_in& out) {
  out = {};
  out.sin_family = AF_INET;
  out.sin_port = htons(static_cast<std::uint16_t>(port));
  return port >= least_port && port <= 65535 && ::inet_pton(AF_INET, host.c_str(), &out.sin_addr) == 1;
}

/// 0x4002, command, length, value: big end first.
std::vector<std::byte> write_request(std::uint32_t command, std::uint32_t value, std::uint32_t bytes) {
  std::vector<std::byte> out;
  for (const std::uint32_t word : {0x4002U, command, bytes}) {
    out.push_back(static_cast<std::byte>(word >> 8));
    out.push_back(static_cast<std::byte>(word & 0xFF));
  }
  for (std::uint32_t i = bytes; i-- > 0;) out.push_back(static_cast<std::byte>(value >> 8 * i & 0xFF));
  return out;
}

}  // namespace

Result<LaserPush> LaserPush::start(const std::string& sensor, int command_port, const std::string& host,
                                   int port, std::size_t channels, Nanoseconds timeout) {
  LaserPush out;
  out.peer_ = sensor + ":" + std::to_string(command_port);
  sockaddr_in peer{}, local{};
  if (!read_address(sensor, command_port, 1, peer))
    return fault("laser.address", out.peer_, "not an IPv4 address and port",
                 "write laser.address as the sensor's dotted address and its command port, 5011");
  const std::string listen = host + ":" + std::to_string(port);
  if (!read_address(host, port, 0, local))
    return fault("laser.address", listen, "not an IPv4 address and port",
                 "write laser.listen as a dotted address of this machine and a port");
  out.sensor_ip_ = peer.sin_addr.s_addr;
  out.data_ = Fd(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  socklen_t size = sizeof local;
  if (!out.data_.valid() || ::bind(out.data_.get(), reinterpret_cast<sockaddr*>(&local), size) != 0 ||
      ::getsockname(out.data_.get(), reinterpret_cast<sockaddr*>(&local), &size) != 0) {
    return fault("laser.listen", listen, std::strerror(errno),
                 "use an address of this machine and a free UDP port in laser.listen");
  }
  const int on = 1;
  ::setsockopt(out.data_.get(), SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
  out.port_ = ntohs(local.sin_port);

  out.command_ = Fd(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  sockaddr_in self{};
  size = sizeof self;
  if (!out.command_.valid() ||
      ::connect(out.command_.get(), reinterpret_cast<sockaddr*>(&peer), sizeof peer) != 0 ||
      ::getsockname(out.command_.get(), reinterpret_cast<sockaddr*>(&self), &size) != 0) {
    return fault("laser.unreachable", out.peer_, std::strerror(errno),
                 "check cable, power and laser.address");
  }
  // Listening everywhere, the address that leads to the sensor is the one that it can reach.
  const in_addr target = local.sin_addr.s_addr == htonl(INADDR_ANY) ? self.sin_addr : local.sin_addr;
  const std::array<std::array<std::uint32_t, 3>, 4> settings{
      {{kPushChannels, 0, 4},
       {kPushIp, ntohl(target.s_addr), 4},
       {kPushPort, static_cast<std::uint32_t>(out.port_), 2},
       {kPushChannels, (1U << channels) - 1, 4}}};
  for (const auto& [command, value, bytes] : settings) {
    if (const Status written = out.write(command, value, bytes, timeout); !written.ok())
      return written.error();
  }
  out.heard_ = now();
  return out;
}

LaserPush::~LaserPush() {
  if (!command_.valid()) return;
  const auto stop = write_request(kPushChannels, 0, 4);
  if (::send(command_.get(), stop.data(), stop.size(), MSG_DONTWAIT | MSG_NOSIGNAL) < 0) return;
}

Status LaserPush::write(std::uint32_t command, std::uint32_t value, std::uint32_t bytes,
                        Nanoseconds timeout) const {
  const auto request = write_request(command, value, bytes);
  std::array<std::byte, 64> reply{};
  for (int i = 0; i < kTries; ++i) {
    if (::send(command_.get(), request.data(), request.size(), MSG_NOSIGNAL) < 0 && errno == ECONNREFUSED)
      return fault("laser.refused", peer_, "the host is there, but nothing listens on this port",
                   "correct the port in laser.address: the sensor takes commands at 5011");
    const HostTime deadline = now() + timeout;
    while (wait_readable(command_.get(), deadline)) {
      const ssize_t n = ::recv(command_.get(), reply.data(), reply.size(), 0);
      if (n < 0 && errno == ECONNREFUSED)
        return fault("laser.refused", peer_, "the host is there, but nothing listens on this port",
                     "correct the port in laser.address: the sensor takes commands at 5011");
      if (n < 2 || reply[0] >> 4 != std::byte{0xC}) continue;
      if (n == 2 && reply[0] == std::byte{0xC0} && reply[1] == std::byte{0}) return Done{};
      char name[64];
      std::snprintf(name, sizeof name, "the sensor refused command 0x%04X", command);
      return fault("laser.refused", peer_, name,
                   "is it an OD5000 or CDX with data push (firmware from 2017)?");
    }
  }
  return fault("laser.timeout", peer_, "no answer to a command", "check cable, power and laser.address");
}

LaserArrival LaserPush::receive(std::span<std::byte> buffer, Nanoseconds timeout) noexcept {
  const HostTime deadline = now() + timeout;
  for (;;) {
    sockaddr_in from{};
    const StampedRead read =
        read_stamped(data_.get(), buffer, reinterpret_cast<sockaddr*>(&from), sizeof from);
    if (read.bytes >= 0 && (from.sin_addr.s_addr != sensor_ip_ || (read.flags & MSG_TRUNC) != 0)) {
      ++foreign_;
      // A flood of them must not hold the thread beyond its time.
      if (now() >= deadline) return {LinkEvent::Timeout, 0, now()};
      continue;
    }
    if (read.bytes > 0) {
      heard_ = read.arrival;
      return {LinkEvent::Data, static_cast<std::size_t>(read.bytes), read.arrival};
    }
    if (read.bytes == 0 || errno == EINTR) continue;
    if (!wait_readable(data_.get(), deadline)) {
      const HostTime at = now();
      closed_ = at - heard_ > kSilence;
      return {closed_ ? LinkEvent::Closed : LinkEvent::Timeout, 0, at};
    }
  }
}

std::string LaserPush::reason() const {
  return closed_ ? "laser " + peer_ + ": no readings for a second" : std::string();
}

}  // namespace weldcell::adapters
