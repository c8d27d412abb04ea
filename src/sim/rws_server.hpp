// The simulated controller's web server: generation 1 over HTTP with digest, generation 2 over TLS with
// basic, sessions, subscriptions over WebSocket. Own threads; the controller is used under the owner's lock
// only.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "sim/tls_identity.hpp"
#include "weldcell/files/cell_file.hpp"
#include "weldcell/sim/controller.hpp"

namespace weldcell::sim {

struct RwsServerOptions {
  files::Endpoint endpoint;
  std::string user = "Default User", password = "robotics";
  std::uint64_t seed = 1;
  double requests_per_s = 20;           ///< 503 above; 0: no limit
  double ping_interval_s = 30;          ///< generation 1 pings its WebSockets
  std::optional<TlsIdentity> identity;  ///< of generation 2; made when absent
};

class RwsServer {
 public:
  /// Listens at once, in the controller's generation. Throws Poco::Exception when the address cannot be
  /// bound.
  RwsServer(RwsServerOptions options, Controller& controller, std::mutex& lock);
  ~RwsServer();
  int port() const;
  /// What came so far.
  RwsLoad load() const;
  std::size_t sessions() const;
  std::size_t subscriptions() const;
  /// SHA-256 of the certificate, "" in generation 1.
  std::string fingerprint() const;

  struct Shared;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace weldcell::sim
