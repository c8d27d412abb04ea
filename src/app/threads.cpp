#include "app/threads.hpp"

#include <spdlog/spdlog.h>

#include "app/device_threads.hpp"
#include "weldcell/adapters/systemd.hpp"

namespace weldcell::app {

namespace {

struct Row {
  rt::ThreadOptions options;
  std::function<void()> body;
};

}  // namespace

Result<std::vector<rt::Thread>> start_threads(Wiring& wiring, CellThread& cell, adapters::EgmSocket& egm,
                                              adapters::ModbusServer& modbus, const std::string& rws_password,
                                              const ResidentModules& resident) {
  constexpr std::size_t kKiB = 1024;
  const bool realtime = wiring.config.realtime != files::RealTime::Off;
  // FIFO 70 and 60 stay below the kernel's own interrupt threads where those are threaded; EGM answers first,
  // because a late reply moves the robot, a late laser block waits in the socket.
  const std::vector<Row> rows{
      {{"egm", realtime ? 70 : 0, 0, 256 * kKiB}, [&] { run_egm(wiring, egm); }},
      {{"laser", realtime ? 60 : 0, 0, 256 * kKiB}, [&] { run_laser(wiring); }},
      {{"cell", 0, 0, 1024 * kKiB}, [&] { cell.run(); }},
      {{"solver", 0, 10, 4096 * kKiB}, [&] { run_solver(wiring); }},
      {{"rws", 0, 0, 512 * kKiB},
       [&wiring, rws_password, resident] { run_rws(wiring, rws_password, resident); }},
      {{"plc", 0, 0, 256 * kKiB}, [&] { run_plc(wiring, modbus); }},
      {{"projector", 0, 0, 1024 * kKiB}, [&] { run_projector(wiring); }},
  };
  std::vector<rt::Thread> threads;
  const auto give_up = [&](Error error) {
    wiring.stopping = true;
    threads.clear();
    return error;
  };
  bool refused = false;
  for (const Row& row : rows) {
    auto started = rt::Thread::start(row.options, row.body);
    if (!started.ok()) return give_up(started.error());
    refused = refused || !started->fifo_granted();
    threads.push_back(std::move(*started));
  }
  const Status locked = realtime ? rt::lock_memory() : Status(Done{});
  if (refused || !locked.ok()) {
    const std::string why = (refused ? "SCHED_FIFO was refused (LimitRTPRIO=80 in the unit) " : "") +
                            (locked.ok() ? std::string{} : locked.error().text());
    if (wiring.config.realtime == files::RealTime::Required)
      return give_up({"realtime", "realtime: required", why, ""});
    spdlog::warn("not real-time: {}; going on because of realtime: try", why);
  }
  return threads;
}

Watchdog::Watchdog(HostTime now) {
  if (const auto interval = adapters::watchdog_interval()) interval_ = *interval;
  next_ = now + pace();
}

void Watchdog::step(Wiring& wiring, HostTime now) {
  if (now < next_) return;
  next_ = now + pace();
  bool all_moved = true;
  for (std::size_t i = 0; i < kThreads; ++i) {
    const std::uint64_t beat = wiring.heartbeats[i].load(std::memory_order_relaxed);
    // The solver works as long as it must and beats only between two steps.
    if (beat == seen_[i] && i != static_cast<std::size_t>(ThreadName::Solver)) {
      all_moved = false;
      spdlog::warn("thread {} gave no sign of life", i);
    }
    seen_[i] = beat;
  }
  if (interval_ > 0 && all_moved) adapters::notify_watchdog();
  const job::CellStatus status = wiring.status();
  const std::string text =
      std::string(job::to_string(status.state)) + (status.job.empty() ? "" : ", job " + status.job);
  if (text != last_status_) adapters::notify_status(text);
  last_status_ = text;
}

}  // namespace weldcell::app
