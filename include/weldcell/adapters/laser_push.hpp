// Readings that an OD5000 pushes over UDP, with kernel receive stamps: the sensor is told over its command
// port where to send. Owned by the laser thread; receive() is real-time safe.
#pragma once

#include <string>
#include <vector>

#include "weldcell/adapters/laser_tcp.hpp"
#include "weldcell/wire/laser_dialects.hpp"

namespace weldcell::adapters {

class LaserPush {
 public:
  /// Listens at host:port (port 0 takes a free one), switches filters and hold of the distance's channel off,
  /// writes this address and the channels into the sensor and starts it. Waits `timeout` for each answer and
  /// asks three times. Errors: "laser.address", "laser.listen" and those of talk_to_laser().
  static Result<LaserPush> start(const std::string& sensor, int command_port, const std::string& host,
                                 int port, const wire::LaserFormat& format, Nanoseconds timeout);
  LaserPush(LaserPush&&) = default;
  LaserPush& operator=(LaserPush&&) = default;
  /// Tells the sensor to stop; it does not say whether it did.
  ~LaserPush();

  /// One datagram of the sensor, or Timeout; Closed after a second without any: it has lost its settings, or
  /// its cable. A datagram longer than the buffer is left out.
  LaserArrival receive(std::span<std::byte> buffer, Nanoseconds timeout) noexcept;
  std::string reason() const;
  int port() const noexcept { return port_; }
  /// What was switched in the sensor at the start, and what it could not be asked.
  const std::vector<std::string>& notes() const noexcept { return notes_; }
  std::uint64_t foreign() const noexcept { return foreign_; }  ///< datagrams from elsewhere, left out

 private:
  LaserPush() = default;

  Fd data_, command_;
  std::string peer_;
  std::uint32_t sensor_ip_ = 0;  ///< network order
  int port_ = 0;
  bool closed_ = false;
  std::uint64_t foreign_ = 0;
  HostTime heard_;
  std::vector<std::string> notes_;
};

}  // namespace weldcell::adapters
