// Every queue of the daemon, with its capacity and what happens when it is full, and the few words that
// threads share.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "app/mailbox.hpp"
#include "weldcell/app/egm_watch.hpp"
#include "weldcell/files/cell_file.hpp"
#include "weldcell/job/cell.hpp"
#include "weldcell/robot/egm_session.hpp"
#include "weldcell/rt/spsc_ring.hpp"
#include "weldcell/wire/rws_replies.hpp"

namespace weldcell::app {

/// One EGM cycle on its way from the real-time thread to the cell.
struct EgmItem {
  HostTime arrival;
  robot::EgmReport report;
  std::uint16_t size = 0, reply_size = 0;
  std::array<std::byte, wire::kEgmMaxBytes> datagram{};
  std::array<std::byte, 512> reply{};
};

struct LaserItem {
  HostTime arrival;
  std::uint16_t size = 0;
  std::array<std::byte, 2048> bytes{};
};

/// A job in the spool's active/ folder.
struct ActiveJob {
  std::string folder;
  job::JobArrived arrived;
  std::string job_yaml;
};

/// Something for the cell from an ordinary thread.
struct Message {
  job::InputBody body;
  std::shared_ptr<const ActiveJob> job;                ///< with JobArrived
  std::shared_ptr<std::promise<std::string>> outcome;  ///< with an operator's command: "" done, else why not
};

struct Shown {
  std::shared_ptr<const guidance::Drawing> drawing;  ///< null: dark
  int step = 0;
  std::string folder;
};

/// Who may speak Modbus, as it was read anew.
struct ModbusAccess {
  std::vector<std::string> allow;
  int max_clients = 0;
};

/// A job that is over: main moves its folder.
struct EndedJob {
  std::string id;
  bool accepted = false;
};

enum class ThreadName : std::size_t { Egm, Laser, Cell, Solver, Rws, Plc, Projector };
inline constexpr std::size_t kThreads = 7;

struct Wiring {
  explicit Wiring(const files::CellConfig& c)
      : config(c), setup(std::make_shared<const cell::CellSetup>(c.setup)), session(c.setup) {}

  const files::CellConfig config;
  const std::shared_ptr<const cell::CellSetup> setup;
  robot::EgmSession session;  ///< cycles on the egm thread only; its stop and arm bits from any

  // One second of data each. Full: the newest is dropped and counted; the cell turns a loss in a scan into a
  // fault.
  rt::SpscRing<EgmItem, 256> egm;
  rt::SpscRing<LaserItem, 1024> laser;

  Mailbox<Message> inbox{1024};  ///< full: the sender's command fails, a device thread tries again
  Mailbox<job::RobotRequest> robot_requests{16};  ///< full: fault, the cell waits for an answer in vain
  Mailbox<std::function<void()>> work{16};        ///< solver; full cannot happen: one order a job step
  Mailbox<Shown> shown{16};                       ///< full: a picture is skipped
  Mailbox<EndedJob> ended{64};
  Mailbox<ModbusAccess> modbus_access{4};  ///< full: the plc thread hangs, and the watchdog says so
  Mailbox<std::shared_ptr<const ActiveJob>> returned{4};  ///< full cannot happen: one job at a time

  std::atomic<const plan::MotionPlan*> offered_plan{nullptr};  ///< cell -> egm; the cell keeps the plan alive
  std::atomic<bool> stopping{false};
  std::atomic<bool> wants_laser{false};
  std::atomic<bool> takes_jobs{true};
  std::atomic<std::int32_t> selected_job{0};   ///< by the PLC; 0 = the spool's order
  std::atomic<std::uint16_t> jobs_waiting{0};  ///< in the spool, without those on hold
  std::array<std::atomic<std::uint64_t>, kThreads> heartbeats{};
  std::atomic<int> egm_port{0}, modbus_port{0};
  std::atomic<wire::ControllerState> controller_state{};  ///< rws -> operator's status
  std::atomic<wire::OperationMode> operation_mode{};
  std::atomic<wire::ExecutionState> execution_state{};
  std::atomic<bool> rws_live{false};  ///< the three come by subscription

  void beat(ThreadName thread) {
    heartbeats[static_cast<std::size_t>(thread)].fetch_add(1, std::memory_order_relaxed);
  }
  job::CellStatus status() const {
    const std::lock_guard lock(status_mutex);
    return last_status;
  }
  /// What hinders the spool, "" when nothing does.
  std::string spool_fault() const {
    const std::lock_guard lock(status_mutex);
    return last_spool_fault;
  }
  void publish_spool_fault(const std::string& text) {
    const std::lock_guard lock(status_mutex);
    last_spool_fault = text;
  }
  void publish(const job::CellStatus& s) {
    const std::lock_guard lock(status_mutex);
    last_status = s;
  }
  void publish(const EgmFigures& figures) {
    const std::lock_guard lock(status_mutex);
    last_egm = figures;
  }
  EgmFigures egm_figures() const {
    const std::lock_guard lock(status_mutex);
    return last_egm;
  }

 private:
  mutable std::mutex status_mutex;
  job::CellStatus last_status;
  EgmFigures last_egm;
  std::string last_spool_fault;
};

}  // namespace weldcell::app
