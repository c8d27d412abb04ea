// The simulated controller's EGM wire: a UDP socket at an ephemeral port that sends first and takes answers
// from the configured peer only. Used from one thread; never blocks.
#pragma once

#include <netinet/in.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "weldcell/files/cell_file.hpp"

namespace weldcell::sim {

class EgmClient {
 public:
  /// Throws std::system_error when there is no socket or the host is no IPv4 address.
  explicit EgmClient(const files::Endpoint& peer);
  ~EgmClient();
  EgmClient(const EgmClient&) = delete;
  EgmClient& operator=(const EgmClient&) = delete;

  /// False when nobody listens there (event 41830 on a controller).
  bool send(std::span<const std::byte> datagram);
  /// The next datagram that waits; datagrams from other addresses are dropped.
  std::optional<std::span<const std::byte>> receive();

 private:
  int socket_ = -1;
  sockaddr_in peer_{};
  std::array<std::byte, 2048> buffer_{};
};

}  // namespace weldcell::sim
