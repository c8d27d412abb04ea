#include "weldcell/adapters/laser_push.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "socket_stamp.hpp"
#include "weldcell/adapters/host_clock.hpp"
#include "weldcell/adapters/laser_commands.hpp"

namespace weldcell::adapters {
namespace {

constexpr Nanoseconds kSilence = kSecond;
constexpr int kTries = 3;
// Data push channel selection, 0: stop. OD5000, operating instructions 8021391, tables 30 and 46.
constexpr std::array<unsigned char, 10> kStop{0x40, 0x02, 0x01, 0xE0, 0x00, 0x04, 0, 0, 0, 0};

Error fault(const char* code, const std::string& where, const std::string& what, const char* mend) {
  return {code, "laser " + where, what, mend};
}

bool read_address(const std::string& host, int port, int least_port, sockaddr_in& out) {
  out = {};
  out.sin_family = AF_INET;
  out.sin_port = htons(static_cast<std::uint16_t>(port));
  return port >= least_port && port <= 65535 && ::inet_pton(AF_INET, host.c_str(), &out.sin_addr) == 1;
}

}  // namespace

Result<LaserPush> LaserPush::start(const std::string& sensor, int command_port, const std::string& host,
                                   int port, const wire::LaserFormat& format, Nanoseconds timeout) {
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
  wire::LaserWanted wanted;
  wanted.format = format;
  wanted.device = "laser " + out.peer_;
  wanted.push_ip = ntohl(target.s_addr);
  wanted.push_port = out.port_;
  const auto setup = wire::laser_setup(wanted);
  auto notes = talk_to_laser(out.command_.get(), wanted.device, *setup, {timeout, kTries, {}});
  if (!notes.ok()) return notes.error();
  out.notes_ = std::move(*notes);
  out.heard_ = now();
  return out;
}

LaserPush::~LaserPush() {
  if (!command_.valid()) return;
  if (::send(command_.get(), kStop.data(), kStop.size(), MSG_DONTWAIT | MSG_NOSIGNAL) < 0) return;
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
