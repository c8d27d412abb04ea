// The simulated PLC's wire: a Modbus TCP client on its own thread that keeps trying until it is told to stop.
#pragma once

#include <atomic>
#include <thread>

#include "sim/plc_worker.hpp"
#include "weldcell/files/cell_file.hpp"

namespace weldcell::sim {

class PlcLink {
 public:
  PlcLink(files::Endpoint endpoint, wire::WordOrder word_order, PlcWorker worker);
  ~PlcLink();
  PlcLink(const PlcLink&) = delete;
  PlcLink& operator=(const PlcLink&) = delete;

  /// Whether the last exchange with the cell succeeded.
  bool connected() const { return connected_; }

 private:
  void run();

  files::Endpoint endpoint_;
  wire::WordOrder word_order_;
  PlcWorker worker_;
  std::atomic<bool> stop_{false}, connected_{false};
  std::thread thread_;
};

}  // namespace weldcell::sim
