// All threads of the daemon are made here, from one table, and watched here.
#pragma once

#include <string>
#include <vector>

#include "app/cell_thread.hpp"
#include "app/device_threads.hpp"
#include "app/wiring.hpp"
#include "weldcell/adapters/egm_udp.hpp"
#include "weldcell/adapters/modbus_server.hpp"
#include "weldcell/rt/thread.hpp"

namespace weldcell::app {

/// Starts every thread. With `realtime: required` a refused FIFO or mlockall is an error; with `try` it is
/// said once. Clearing the vector joins them: set wiring.stopping first.
Result<std::vector<rt::Thread>> start_threads(Wiring& wiring, CellThread& cell, adapters::EgmSocket& egm,
                                              adapters::ModbusServer& modbus, const std::string& rws_password,
                                              const ResidentModules& resident);

/// Kicks systemd's watchdog only while every thread's heartbeat moves.
class Watchdog {
 public:
  /// First asks when the threads have had time for a beat.
  explicit Watchdog(HostTime now);
  void step(Wiring& wiring, HostTime now);

 private:
  Nanoseconds pace() const { return interval_ > 0 ? interval_ / 2 : kSecond; }

  Nanoseconds interval_ = 0;  ///< 0: no watchdog
  HostTime next_;
  std::string last_status_;
  std::array<std::uint64_t, kThreads> seen_{};
};

}  // namespace weldcell::app
