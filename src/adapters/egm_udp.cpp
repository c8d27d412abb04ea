#include "weldcell/adapters/egm_udp.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "socket_stamp.hpp"
#include "weldcell/adapters/host_clock.hpp"

namespace weldcell::adapters {
namespace {

Error fault(const char* code, const std::string& host, int port, const std::string& what, const char* mend) {
  return {code, "egm " + host + ":" + std::to_string(port), what, mend};
}

}  // namespace

Result<EgmSocket> EgmSocket::bind(const std::string& host, int port, const std::string& peer) {
  EgmSocket out;
  sockaddr_in local{};
  local.sin_family = AF_INET;
  if (port < 0 || port > 65535 || inet_pton(AF_INET, host.c_str(), &local.sin_addr) != 1)
    return fault("egm.address", host, port, "not an IPv4 address and port",
                 "write a dotted address of this host, or 0.0.0.0, and a port from 0 to 65535");
  if (!peer.empty()) {
    if (inet_pton(AF_INET, peer.c_str(), &out.peer_filter_) != 1)
      return fault("egm.address", host, port, "peer '" + peer + "' is not an IPv4 address",
                   "write the robot controller's dotted address");
    out.filtered_ = true;
  }
  local.sin_port = htons(static_cast<std::uint16_t>(port));

  out.fd_ = Fd(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!out.fd_.valid() ||
      ::bind(out.fd_.get(), reinterpret_cast<const sockaddr*>(&local), sizeof local) != 0) {
    const int reason = errno;
    return fault("egm.bind", host, port, std::strerror(reason),
                 reason == EADDRINUSE ? "another program has this UDP port: stop it or choose another"
                                      : "use an address of this host");
  }
  const int on = 1;
  ::setsockopt(out.fd_.get(), SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
  socklen_t bytes = sizeof local;
  ::getsockname(out.fd_.get(), reinterpret_cast<sockaddr*>(&local), &bytes);
  out.port_ = ntohs(local.sin_port);
  return out;
}

bool EgmSocket::admits(const sockaddr_in& sender, HostTime arrival) noexcept {
  if (filtered_) {
    if (sender.sin_addr.s_addr != peer_filter_.s_addr) return false;
  } else if (has_peer_ && arrival - peer_heard_ < kEgmPeerSilence) {
    if (sender.sin_addr.s_addr != peer_.sin_addr.s_addr || sender.sin_port != peer_.sin_port) return false;
  }
  peer_ = sender;
  has_peer_ = true;
  peer_heard_ = arrival;
  return true;
}

EgmSocket::Take EgmSocket::take(std::span<std::byte> buffer, EgmArrival& out) noexcept {
  sockaddr_in sender{};
  const StampedRead read =
      read_stamped(fd_.get(), scratch_, reinterpret_cast<sockaddr*>(&sender), sizeof sender);
  if (read.bytes < 0) {
    if (errno == EAGAIN || errno == EWOULDBLOCK) return Take::Empty;
    ++counters_.receive_errors;
    return Take::Skipped;
  }
  const auto bytes = static_cast<std::size_t>(read.bytes);
  if (bytes == 0 || bytes > buffer.size() || (read.flags & MSG_TRUNC) != 0) {
    ++counters_.oversize;
    return Take::Skipped;
  }
  if (!admits(sender, read.arrival)) {
    ++counters_.foreign;
    return Take::Skipped;
  }
  std::memcpy(buffer.data(), scratch_.data(), bytes);
  out = {bytes, read.arrival};
  return Take::Datagram;
}

EgmArrival EgmSocket::receive(std::span<std::byte> buffer, Nanoseconds timeout) noexcept {
  const HostTime deadline = now() + timeout;
  EgmArrival out;
  for (;;) {
    switch (take(buffer, out)) {
      case Take::Datagram:
        ++counters_.received;
        return out;
      case Take::Skipped:
        // A flood of foreign datagrams must not hold the thread beyond its time.
        if (now() >= deadline) return {};
        break;
      case Take::Empty:
        if (!wait_readable(fd_.get(), deadline)) return {};
        break;
    }
  }
}

EgmArrival EgmSocket::receive_newest(std::span<std::byte> buffer, Nanoseconds timeout) noexcept {
  constexpr int kMostDrained = 64;
  EgmArrival out = receive(buffer, timeout);
  if (!out) return out;
  for (int i = 0; i < kMostDrained; ++i) {
    const Take taken = take(buffer, out);
    if (taken == Take::Empty) break;
    if (taken == Take::Datagram) ++counters_.superseded;
  }
  return out;
}

bool EgmSocket::reply(std::span<const std::byte> datagram) noexcept {
  if (!has_peer_) return false;
  const ssize_t sent = ::sendto(fd_.get(), datagram.data(), datagram.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
                                reinterpret_cast<const sockaddr*>(&peer_), sizeof peer_);
  if (sent != static_cast<ssize_t>(datagram.size())) {
    ++counters_.send_errors;
    return false;
  }
  ++counters_.sent;
  return true;
}

}  // namespace weldcell::adapters
