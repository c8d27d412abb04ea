#include "weldcell/adapters/laser_tcp.hpp"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>

#include "socket_stamp.hpp"
#include "weldcell/adapters/host_clock.hpp"

namespace weldcell::adapters {
namespace {

// The sensor streams all the time, so a silent peer is soon a lost one: about 5 s.
constexpr int kKeepAliveIdleSeconds = 2;
constexpr int kKeepAliveIntervalSeconds = 1;
constexpr int kKeepAliveCount = 3;

void set_option(int fd, int level, int name, int value) {
  ::setsockopt(fd, level, name, &value, sizeof value);
}

void configure(int fd) {
  set_option(fd, SOL_SOCKET, SO_TIMESTAMPNS, 1);
  set_option(fd, SOL_SOCKET, SO_KEEPALIVE, 1);
  set_option(fd, IPPROTO_TCP, TCP_KEEPIDLE, kKeepAliveIdleSeconds);
  set_option(fd, IPPROTO_TCP, TCP_KEEPINTVL, kKeepAliveIntervalSeconds);
  set_option(fd, IPPROTO_TCP, TCP_KEEPCNT, kKeepAliveCount);
  set_option(fd, IPPROTO_TCP, TCP_NODELAY, 1);
}

Error fault(const char* code, const std::string& peer, const std::string& what, const char* mend) {
  return {code, "laser " + peer, what, mend};
}

Error connect_fault(const std::string& peer, int reason) {
  if (reason == ECONNREFUSED)
    return fault("laser.refused", peer, "the host is there, but nothing listens on this port",
                 "switch the sensor's data server on or correct the port in laser.address");
  return fault("laser.unreachable", peer, std::strerror(reason), "check cable, power and laser.address");
}

}  // namespace

Result<LaserSocket> LaserSocket::connect(const std::string& host, int port, Nanoseconds timeout) {
  LaserSocket out;
  out.peer_ = host + ":" + std::to_string(port);
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  if (port <= 0 || port > 65535 ||
      ::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found) != 0)
    return fault("laser.address", out.peer_, "not an IPv4 address and port",
                 "write laser.address as the sensor's dotted address and a port from 1 to 65535");
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> address(found, &::freeaddrinfo);

  out.fd_ = Fd(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!out.fd_.valid()) return connect_fault(out.peer_, errno);
  configure(out.fd_.get());
  if (::connect(out.fd_.get(), address->ai_addr, address->ai_addrlen) != 0) {
    if (errno != EINPROGRESS) return connect_fault(out.peer_, errno);
    pollfd wanted{out.fd_.get(), POLLOUT, 0};
    const Nanoseconds wait = std::max<Nanoseconds>(timeout, 0);
    const std::timespec limit{wait / kSecond, wait % kSecond};
    if (::ppoll(&wanted, 1, &limit, nullptr) <= 0)
      return fault("laser.timeout", out.peer_, "no answer", "check cable, power and laser.address");
    int reason = 0;
    socklen_t bytes = sizeof reason;
    ::getsockopt(out.fd_.get(), SOL_SOCKET, SO_ERROR, &reason, &bytes);
    if (reason != 0) return connect_fault(out.peer_, reason);
  }
  return out;
}

LaserArrival LaserSocket::receive(std::span<std::byte> buffer, Nanoseconds timeout) noexcept {
  const HostTime deadline = now() + timeout;
  for (;;) {
    const StampedRead read = read_stamped(fd_.get(), buffer, nullptr, 0);
    if (read.bytes > 0) {
      kernel_stamps_ = read.kernel_stamp;
      return {LinkEvent::Data, static_cast<std::size_t>(read.bytes), read.arrival};
    }
    if (read.bytes == 0) {
      closed_ = true;
      return {LinkEvent::Closed, 0, read.arrival};
    }
    if (errno == EINTR) continue;
    if (errno != EAGAIN && errno != EWOULDBLOCK) {
      error_number_ = errno;
      return {LinkEvent::Failed, 0, now()};
    }
    if (!wait_readable(fd_.get(), deadline)) return {LinkEvent::Timeout, 0, now()};
  }
}

std::string LaserSocket::reason() const {
  if (error_number_ != 0) return "laser " + peer_ + ": connection lost: " + std::strerror(error_number_);
  if (closed_) return "laser " + peer_ + ": the sensor closed the connection";
  return {};
}

}  // namespace weldcell::adapters
