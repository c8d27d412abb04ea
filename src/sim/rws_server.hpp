// The simulated controller's web server: RWS 1.0 over HTTP, with digest and sessions. Own threads; the
// controller is used under the owner's lock only.
#pragma once

#include <memory>
#include <mutex>
#include <string>

#include "weldcell/files/cell_file.hpp"
#include "weldcell/sim/controller.hpp"

namespace weldcell::sim {

class RwsServer {
 public:
  /// Listens at once. Throws Poco::Exception when the address cannot be bound.
  RwsServer(const files::Endpoint& endpoint, const std::string& user, const std::string& password,
            std::uint64_t seed, Controller& controller, std::mutex& lock);
  ~RwsServer();
  int port() const;
  std::size_t sessions() const;

  struct Shared;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace weldcell::sim
