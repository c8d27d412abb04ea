#include "socket_stamp.hpp"

#include <poll.h>
#include <sys/uio.h>

#include <algorithm>
#include <cstring>
#include <ctime>

#include "weldcell/adapters/host_clock.hpp"

namespace weldcell::adapters {

StampedRead read_stamped(int fd, std::span<std::byte> buffer, sockaddr* sender,
                         socklen_t sender_bytes) noexcept {
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(std::timespec))];
  iovec piece{buffer.data(), buffer.size()};
  msghdr message{};
  message.msg_name = sender;
  message.msg_namelen = sender_bytes;
  message.msg_iov = &piece;
  message.msg_iovlen = 1;
  message.msg_control = control;
  message.msg_controllen = sizeof control;

  StampedRead out;
  out.bytes = ::recvmsg(fd, &message, MSG_DONTWAIT);
  if (out.bytes < 0) return out;
  out.flags = message.msg_flags;
  for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
    if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_TIMESTAMPNS) continue;
    std::timespec stamp{};
    std::memcpy(&stamp, CMSG_DATA(c), sizeof stamp);
    if (stamp.tv_sec == 0 && stamp.tv_nsec == 0) continue;
    out.arrival = from_realtime(stamp);
    out.kernel_stamp = true;
    return out;
  }
  out.arrival = now();
  return out;
}

bool wait_readable(int fd, HostTime deadline) noexcept {
  const Nanoseconds left = std::max<Nanoseconds>(deadline - now(), 0);
  const std::timespec timeout{left / kSecond, left % kSecond};
  pollfd wanted{fd, POLLIN, 0};
  return ::ppoll(&wanted, 1, &timeout, nullptr) > 0;
}

}  // namespace weldcell::adapters
