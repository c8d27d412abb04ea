// The laser's byte stream over TCP with kernel receive stamps. Owned by the laser thread; receive() is
// real-time safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "weldcell/adapters/fd.hpp"
#include "weldcell/base/result.hpp"
#include "weldcell/base/time.hpp"

namespace weldcell::adapters {

enum class LinkEvent : std::uint8_t {
  Data,     ///< bytes > 0
  Timeout,  ///< nothing came; the link stands
  Closed,   ///< the sensor closed the connection
  Failed    ///< reset, unreachable, keep-alive expired: see reason()
};

struct LaserArrival {
  LinkEvent event = LinkEvent::Timeout;
  std::size_t bytes = 0;
  HostTime
      arrival;  ///< of the last byte returned, as the kernel saw it; time of reading where it gives no stamp
};

class LaserSocket {
 public:
  /// Connects within `timeout`. When to try again is the caller's matter. Errors: "laser.address",
  /// "laser.unreachable", "laser.timeout", "laser.refused".
  static Result<LaserSocket> connect(const std::string& host, int port, Nanoseconds timeout);

  /// Waits at most `timeout` for bytes and copies what is there, up to the buffer's size.
  LaserArrival receive(std::span<std::byte> buffer, Nanoseconds timeout) noexcept;
  /// Why receive() said Closed or Failed, in words with the address; "" while the link stands. Allocates.
  std::string reason() const;
  int fd() const noexcept { return fd_.get(); }
  bool kernel_stamps() const noexcept { return kernel_stamps_; }  ///< the last arrival came from the kernel

 private:
  LaserSocket() = default;
  Fd fd_;
  std::string peer_;
  bool closed_ = false;
  bool kernel_stamps_ = false;
  int error_number_ = 0;
};

}  // namespace weldcell::adapters
