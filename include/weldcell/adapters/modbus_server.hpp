// Modbus TCP server for the PLC: two register blocks, whole checked frames only, no client can hold up
// another. Owned by the plc thread.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "weldcell/base/result.hpp"
#include "weldcell/base/time.hpp"
#include "weldcell/wire/plc_map.hpp"

namespace weldcell::adapters {

using PlcWords = std::array<std::uint16_t, wire::kPlcWriteWords>;
using PlcStatusWords = std::array<std::uint16_t, wire::kPlcReadWords>;

struct ModbusOptions {
  std::string host = "127.0.0.1";
  int port = 502;      ///< 0 takes a free one
  int listen_fd = -1;  ///< a listening socket handed over by systemd; host and port then mean nothing
  std::vector<std::uint8_t> unit_ids{0, 1, 255};  ///< answered; others get exception 0x0B
  std::vector<std::string> allowed_clients;  ///< dotted IPv4; empty = every address that can reach the port
  Nanoseconds idle_before_eviction =
      10 * kSecond;     ///< with every place taken, a new client may push out one so long silent
  int max_clients = 8;  ///< one more is closed at once, unless one is idle
  int max_requests_per_second = 1000;  ///< of one client; beyond it, its bytes wait in its own connection
  Nanoseconds half_frame_timeout =
      2 * kSecond;  ///< a frame begun and not ended for so long closes its connection
};

struct ModbusCounters {
  std::uint64_t requests = 0;  ///< whole frames answered, exceptions included
  std::uint64_t exceptions = 0;
  std::uint64_t malformed = 0;        ///< connections closed for a frame that is not Modbus
  std::uint64_t refused_clients = 0;  ///< over the limit or not allowed
  std::uint64_t throttled = 0;        ///< times that a client had used up its requests
  std::uint64_t orders_lost = 0;      ///< images pushed out because nobody called take_order()
};

/// Function codes 3, 6, 16 and 23; others get exception 1. The PLC may write [0, 10) and read [0, 10) and
/// [100, 140); a range that leaves its block gets exception 2. One frame is handled at a time, so an image
/// never mixes two writes.
class ModbusServer {
 public:
  /// Errors: "modbus.address", "modbus.bind" (port taken; below 1024 without the right), "modbus.library".
  static Result<ModbusServer> listen(const ModbusOptions& options);
  ModbusServer(ModbusServer&&) noexcept;
  ModbusServer& operator=(ModbusServer&&) noexcept;
  ~ModbusServer();

  int port() const noexcept;
  int clients() const noexcept;
  /// Who may connect from now on, at most how many; a client that may no longer is closed. "modbus.address":
  /// not an IPv4 address, nothing changes.
  Status set_access(const std::vector<std::string>& allowed_clients, int max_clients);
  /// What the PLC reads from now on.
  void set_status(const PlcStatusWords& words) noexcept;
  /// The block that the PLC writes, as it stands.
  PlcWords words() const noexcept;
  /// One step: waits at most `timeout` for traffic, then accepts, reads and answers everything that is there.
  /// Ends early after traffic, so the caller can act on an order at once.
  void poll(Nanoseconds timeout) noexcept;
  /// Images of the PLC's block in the order in which writes changed it, one a call; empty when there is no
  /// further one.
  std::optional<PlcWords> take_order() noexcept;
  const ModbusCounters& counters() const noexcept;

 private:
  struct State;
  explicit ModbusServer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace weldcell::adapters
