// The simulated laser's wire: a TCP server that sends the live stream to every client, and takes commands
// beside it or in it.
#pragma once

#include <deque>
#include <vector>

#include "sim/laser_interpreter.hpp"
#include "weldcell/files/cell_file.hpp"
#include "weldcell/sim/laser.hpp"

namespace weldcell::sim {

/// Where the simulated sensor's bytes leave it. Used from one thread; never blocks.
class LaserOutlet {
 public:
  virtual ~LaserOutlet() = default;
  virtual int port() const = 0;
  /// Where commands are taken; 0: in the stream, or nowhere.
  virtual int command_port() const = 0;
  /// Takes in clients, or their commands, that have come.
  virtual void serve() = 0;
  /// Sends blocks that are due.
  virtual void send_due(std::deque<LaserBlock>& blocks, HostTime now) = 0;
  /// As a sensor without power or cable: nobody is served any longer.
  virtual void drop_clients() = 0;
};

class LaserServer final : public LaserOutlet {
 public:
  /// Listens at once, and for commands as the cell file says. Throws std::system_error when an address cannot
  /// be bound.
  explicit LaserServer(const files::CellConfig& cell);
  ~LaserServer() override;
  LaserServer(const LaserServer&) = delete;
  LaserServer& operator=(const LaserServer&) = delete;

  int port() const override { return port_; }
  int command_port() const override { return command_port_; }
  void serve() override;
  /// A client that does not keep up (1 MB behind) is dropped, as the sensor would.
  void send_due(std::deque<LaserBlock>& blocks, HostTime now) override;
  void drop_clients() override;

 private:
  struct Client {
    int socket;
    bool readings, commands;  ///< gets them; may send them
    std::vector<std::byte> backlog;
  };
  void welcome(int listener, bool readings, bool commands);
  /// False when the client has gone.
  bool hear(Client& client);
  bool flush(Client& client);

  bool commands_in_stream_;
  int listener_ = -1, command_listener_ = -1;
  int port_ = 0, command_port_ = 0;
  std::unique_ptr<LaserInterpreter> interpreter_;
  std::vector<Client> clients_;
};

}  // namespace weldcell::sim
