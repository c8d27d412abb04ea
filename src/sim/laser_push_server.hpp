// The simulated OD5000's wire: commands on a UDP port, and readings pushed to whom they name. Used from one
// thread; never blocks.
#pragma once

#include <array>
#include <span>

#include "sim/laser_server.hpp"

namespace weldcell::sim {

class LaserPushServer final : public LaserOutlet {
 public:
  /// The command port is open at once. Throws std::system_error when the address cannot be bound.
  explicit LaserPushServer(const files::CellConfig& cell);
  ~LaserPushServer() override;
  LaserPushServer(const LaserPushServer&) = delete;
  LaserPushServer& operator=(const LaserPushServer&) = delete;

  int port() const override { return port_; }
  int command_port() const override { return port_; }
  /// Answers the commands that have come.
  void serve() override;
  void send_due(std::deque<LaserBlock>& blocks, HostTime now) override;
  /// As after a loss of power: nothing is pushed until it is told to again.
  void drop_clients() override;

 private:
  std::vector<std::byte> answer(std::span<const std::byte> request);
  std::uint32_t* setting(std::uint32_t command);

  int control_ = -1, data_ = -1;
  int port_ = 0;
  std::uint32_t channels_ = 0, target_port_ = 0, target_ip_ = 0, firmware_ = 0x00030008;
  std::uint32_t sampling_rate_;
  struct Channel {
    std::uint32_t median = 0, moving_average = 1, hold = 0;
  };
  std::array<Channel, 4> filters_;
};

}  // namespace weldcell::sim
