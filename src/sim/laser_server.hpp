// The simulated laser's wire: a TCP server that sends the live stream to every client. Used from one thread;
// never blocks.
#pragma once

#include <deque>
#include <vector>

#include "weldcell/files/cell_file.hpp"
#include "weldcell/sim/laser.hpp"

namespace weldcell::sim {

class LaserServer {
 public:
  /// Listens at once. Throws std::system_error when the address cannot be bound.
  explicit LaserServer(const files::Endpoint& endpoint);
  ~LaserServer();
  LaserServer(const LaserServer&) = delete;
  LaserServer& operator=(const LaserServer&) = delete;

  int port() const { return port_; }
  void accept_clients();
  /// Sends blocks that are due; a client that does not keep up (1 MB behind) is dropped, as the sensor would.
  void send_due(std::deque<LaserBlock>& blocks, HostTime now);
  void drop_clients();
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
