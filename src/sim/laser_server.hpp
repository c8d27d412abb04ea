// The simulated laser's wire: a TCP server that sends the live stream to every client.
#pragma once

#include <deque>
#include <vector>

#include "weldcell/files/cell_file.hpp"
#include "weldcell/sim/laser.hpp"

namespace weldcell::sim {

/// Where the simulated sensor's bytes leave it. Used from one thread; never blocks.
class LaserOutlet {
 public:
  virtual ~LaserOutlet() = default;
  virtual int port() const = 0;
  /// Takes in clients, or their commands, that have come.
  virtual void serve() = 0;
  /// Sends blocks that are due.
  virtual void send_due(std::deque<LaserBlock>& blocks, HostTime now) = 0;
  /// As a sensor without power or cable: nobody is served any longer.
  virtual void drop_clients() = 0;
};

class LaserServer final : public LaserOutlet {
 public:
  /// Listens at once. Throws std::system_error when the address cannot be bound.
  explicit LaserServer(const files::Endpoint& endpoint);
  ~LaserServer() override;
  LaserServer(const LaserServer&) = delete;
  LaserServer& operator=(const LaserServer&) = delete;

  int port() const override { return port_; }
  void serve() override;
  /// A client that does not keep up (1 MB behind) is dropped, as the sensor would.
  void send_due(std::deque<LaserBlock>& blocks, HostTime now) override;
  void drop_clients() override;
  std::size_t clients() const { return clients_.size(); }

 private:
  struct Client {
    int socket;
    std::vector<std::byte> backlog;
  };
  bool flush(Client& client);

  int listener_ = -1;
  int port_ = 0;
  std::vector<Client> clients_;
};

}  // namespace weldcell::sim
