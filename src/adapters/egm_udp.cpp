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

  out.fd_ = Fd(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
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

void EgmSocket::set_timeout(Nanoseconds timeout) noexcept {
  // Zero would mean for ever.
  timeout = std::max<Nanoseconds>(timeout, kMicrosecond);
  if (timeout == timeout_) return;
  const timeval limit{timeout / kSecond, (timeout % kSecond) / kMicrosecond};
  if (::setsockopt(fd_.get(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit) == 0) timeout_ = timeout;
}

unsigned EgmSocket::take(unsigned most, int flags, std::span<std::byte> buffer, EgmArrival& out) noexcept {
  std::array<StampedMessage, kBatch> stamped;
  std::array<sockaddr_in, kBatch> senders;
  std::array<mmsghdr, kBatch> messages;
  for (unsigned i = 0; i < most; ++i)
    messages[i].msg_hdr =
        stamped[i].header(scratch_[i], reinterpret_cast<sockaddr*>(&senders[i]), sizeof senders[i]);
  const int count = ::recvmmsg(fd_.get(), messages.data(), most, flags, nullptr);
  if (count < 0) {
    if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR) return 0;
    ++counters_.receive_errors;
    return 1;
  }
  for (unsigned i = 0; i < static_cast<unsigned>(count); ++i) {
    const std::size_t bytes = messages[i].msg_len;
    if (bytes == 0 || bytes > buffer.size() || (messages[i].msg_hdr.msg_flags & MSG_TRUNC) != 0) {
      ++counters_.oversize;
      continue;
    }
    const HostTime arrival = arrival_of(messages[i].msg_hdr).at;
    if (!admits(senders[i], arrival)) {
      ++counters_.foreign;
      continue;
    }
    ++(out ? counters_.superseded : counters_.received);
    std::memcpy(buffer.data(), scratch_[i].data(), bytes);
    out = {bytes, arrival};
  }
  return static_cast<unsigned>(count);
}

EgmArrival EgmSocket::receive_of(unsigned batch, std::span<std::byte> buffer, Nanoseconds timeout) noexcept {
  constexpr unsigned kMostDrained = 64;
  set_timeout(timeout);
  EgmArrival out;
  HostTime deadline{-1};
  // Sleeps in the kernel for the first datagram and takes what has queued up behind it in the same call.
  unsigned taken = take(batch, MSG_WAITFORONE, buffer, out);
  while (taken > 0 && !out) {
    // A flood of foreign datagrams must not hold the thread beyond its time.
    const HostTime at = now();
    if (deadline.ns < 0) deadline = at + timeout;
    if (at >= deadline) return out;
    taken = take(batch, MSG_WAITFORONE, buffer, out);
  }
  for (unsigned sum = taken; batch > 1 && taken == batch && sum < kMostDrained; sum += taken)
    taken = take(batch, MSG_DONTWAIT, buffer, out);
  return out;
}

EgmArrival EgmSocket::receive(std::span<std::byte> buffer, Nanoseconds timeout) noexcept {
  return receive_of(1, buffer, timeout);
}

EgmArrival EgmSocket::receive_newest(std::span<std::byte> buffer, Nanoseconds timeout) noexcept {
  return receive_of(kBatch, buffer, timeout);
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
