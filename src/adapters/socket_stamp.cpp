#include "socket_stamp.hpp"

#include <poll.h>

#include <algorithm>
#include <cstring>

#include "weldcell/adapters/host_clock.hpp"

namespace weldcell::adapters {

msghdr StampedMessage::header(std::span<std::byte> buffer, sockaddr* sender,
                              socklen_t sender_bytes) noexcept {
  piece_ = {buffer.data(), buffer.size()};
  msghdr out{};
  out.msg_name = sender;
  out.msg_namelen = sender_bytes;
  out.msg_iov = &piece_;
  out.msg_iovlen = 1;
  out.msg_control = control_;
  out.msg_controllen = sizeof control_;
  return out;
}

Stamp arrival_of(msghdr& message) noexcept {
  for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
    if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_TIMESTAMPNS) continue;
    std::timespec stamp{};
    std::memcpy(&stamp, CMSG_DATA(c), sizeof stamp);
    if (stamp.tv_sec == 0 && stamp.tv_nsec == 0) continue;
    return {from_realtime(stamp), true};
  }
  return {now(), false};
}

StampedRead read_stamped(int fd, std::span<std::byte> buffer, sockaddr* sender,
                         socklen_t sender_bytes) noexcept {
  StampedMessage stamped;
  msghdr message = stamped.header(buffer, sender, sender_bytes);
  StampedRead out;
  out.bytes = ::recvmsg(fd, &message, MSG_DONTWAIT);
  if (out.bytes < 0) return out;
  out.flags = message.msg_flags;
  const Stamp stamp = arrival_of(message);
  out.arrival = stamp.at;
  out.kernel_stamp = stamp.of_kernel;
  return out;
}

bool wait_readable(int fd, HostTime deadline) noexcept {
  const Nanoseconds left = std::max<Nanoseconds>(deadline - now(), 0);
  const std::timespec timeout{left / kSecond, left % kSecond};
  pollfd wanted{fd, POLLIN, 0};
  return ::ppoll(&wanted, 1, &timeout, nullptr) > 0;
}

}  // namespace weldcell::adapters
