// The simulated cell in real time: controller, laser and PLC on their sockets. One loop on the calling
// thread; the web server and the PLC have their own threads.
#pragma once

#include <atomic>
#include <deque>
#include <memory>
#include <mutex>
#include <string>

#include "sim/egm_client.hpp"
#include "sim/fault_input.hpp"
#include "sim/laser_server.hpp"
#include "sim/plc_link.hpp"
#include "sim/rws_server.hpp"
#include "weldcell/sim/fault_schedule.hpp"

namespace weldcell::sim {

struct LiveOptions {
  std::string truth_file;
  bool plc = true;
  bool plc_rearm = false;
  int fault_fd = -1;             ///< whence faults are read while it runs; -1: none
  std::string certificate_file;  ///< PEM of RWS 2.0, made when absent; "" makes a new one at every start
};

class LiveCell {
 public:
  /// Binds all sockets. Throws std::exception when one cannot be had.
  LiveCell(Scene scene, LiveOptions options);

  /// Runs until `stop` is set. Writes the truth at the start, after each program that welded and at the end.
  void run(const std::atomic<bool>& stop);
  /// Addresses in use, as JSON.
  std::string ports_json() const;

 private:
  void cycle(HostTime now);
  void start_faults(HostTime now);
  void write_truth();

  Scene scene_;
  LiveOptions options_;
  std::mutex lock_;
  Controller controller_;
  LaserDevice laser_;
  EgmClient egm_;
  std::unique_ptr<LaserOutlet> laser_outlet_;
  RwsServer rws_;
  std::unique_ptr<PlcLink> plc_;
  std::deque<LaserBlock> blocks_;
  FaultSchedule faults_;
  FaultInput fault_input_;
  HostTime start_;
  std::uint64_t programs_ended_ = 0, programs_seen_ = 0;
};

}  // namespace weldcell::sim
