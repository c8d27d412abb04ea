// Kernel receive stamps of a message: recvmsg with SO_TIMESTAMPNS. Private to the adapters; real-time safe.
#pragma once

#include <sys/socket.h>
#include <sys/types.h>
#include <sys/uio.h>

#include <cstddef>
#include <ctime>
#include <span>

#include "weldcell/base/time.hpp"

namespace weldcell::adapters {

/// Room for the control data of one message, and the header to receive it with.
class StampedMessage {
 public:
  msghdr header(std::span<std::byte> buffer, sockaddr* sender, socklen_t sender_bytes) noexcept;

 private:
  alignas(cmsghdr) char control_[CMSG_SPACE(sizeof(std::timespec))];
  iovec piece_;
};

struct Stamp {
  HostTime at;
  bool of_kernel = false;  ///< false: the time of reading
};
/// When the kernel had the message just received with this header.
Stamp arrival_of(msghdr& message) noexcept;

struct StampedRead {
  ssize_t bytes = -1;         ///< as recvmsg returns it
  int flags = 0;              ///< MSG_TRUNC and friends
  HostTime arrival;           ///< of the last byte read
  bool kernel_stamp = false;  ///< false: the time of reading
};

/// One non-blocking recvmsg; `sender` may be null.
StampedRead read_stamped(int fd, std::span<std::byte> buffer, sockaddr* sender,
                         socklen_t sender_bytes) noexcept;

/// Waits until fd is readable or hung up. False at the deadline or after a signal.
bool wait_readable(int fd, HostTime deadline) noexcept;

}  // namespace weldcell::adapters
