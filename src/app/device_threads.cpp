#include "app/device_threads.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <optional>

#include "weldcell/adapters/host_clock.hpp"
#include "weldcell/adapters/projector_png.hpp"
#include "weldcell/adapters/projector_window.hpp"

namespace weldcell::app {

namespace {

constexpr Nanoseconds kPoll = 100 * kMillisecond;

bool stopping(const Wiring& wiring) { return wiring.stopping.load(std::memory_order_relaxed); }

}  // namespace

void report_link(Wiring& wiring, job::Link link, bool up, const std::string& detail) {
  // The cell must not miss a link: when its inbox is full, it is asked again at the next change of the
  // device.
  wiring.inbox.push({job::LinkChange{link, up, detail}, nullptr, nullptr});
}

void run_egm(Wiring& wiring, adapters::EgmSocket& socket) {
  EgmItem item;
  HostTime silent_at{-1};
  for (;;) {
    if (stopping(wiring)) {
      // The controller goes on with the last speed it was told: zero must be the last.
      if (silent_at.ns < 0) {
        wiring.session.request_stop();
        silent_at = adapters::now() + kSecond;
      }
      if (wiring.session.at_rest() || adapters::now() >= silent_at) break;
    }
    const adapters::EgmArrival got = socket.receive_newest(item.datagram, kPoll);
    wiring.beat(ThreadName::Egm);
    if (!got) continue;
    if (const plan::MotionPlan* plan = wiring.offered_plan.exchange(nullptr, std::memory_order_acquire)) {
      wiring.session.offer(plan);
    }
    item.arrival = got.arrival;
    item.size = static_cast<std::uint16_t>(got.bytes);
    const std::size_t size =
        wiring.session.on_datagram(std::span(item.datagram).first(got.bytes), got.arrival, item.reply);
    item.reply_size = static_cast<std::uint16_t>(size);
    if (size > 0) socket.reply(std::span(item.reply).first(size));
    item.report = wiring.session.report();
    wiring.egm.push(item);
  }
}

void run_plc(Wiring& wiring, adapters::ModbusServer& server) {
  wire::PlcOrder last;
  bool told_order = false;
  HostTime last_heartbeat_change, next_beat;
  std::uint16_t own_heartbeat = 0, heard_heartbeat = 0;
  bool link = false;
  while (!stopping(wiring)) {
    server.poll(50 * kMillisecond);
    wiring.beat(ThreadName::Plc);
    for (const ModbusAccess& access : wiring.modbus_access.take_all()) {
      const Status status = server.set_access(access.allow, access.max_clients);
      if (!status.ok()) spdlog::error("{}", status.error().text());
    }
    const HostTime now = adapters::now();
    while (const auto words = server.take_order()) {
      const wire::PlcOrder order = wire::decode_plc_order(*words, wiring.config.word_order);
      if (!link || order.heartbeat != heard_heartbeat) last_heartbeat_change = now;
      heard_heartbeat = order.heartbeat;
      if (!link) {
        link = true;
        report_link(wiring, job::Link::Plc, true, "heartbeat");
      }
      if (!told_order || order.command_sequence != last.command_sequence ||
          order.job_number != last.job_number) {
        wiring.inbox.push({job::PlcInput{order}, nullptr, nullptr});
      }
      last = order;
      told_order = true;
    }
    if (link && seconds(now - last_heartbeat_change) > wiring.config.plc_heartbeat_timeout_s) {
      link = false;
      told_order = false;
      report_link(wiring, job::Link::Plc, false, "its heartbeat stands still");
    }
    if (now >= next_beat) {
      next_beat = now + 500 * kMillisecond;
      ++own_heartbeat;
    }
    wire::PlcStatus status = wiring.status().plc;
    status.heartbeat = own_heartbeat;
    status.jobs_waiting = wiring.jobs_waiting.load(std::memory_order_relaxed);
    server.set_status(wire::encode_plc_status(status, wiring.config.word_order));
  }
}

void run_projector(Wiring& wiring) {
  std::optional<adapters::ProjectorWindow> window;
  if (wiring.config.projector_window) {
    auto opened = adapters::ProjectorWindow::open();
    if (opened.ok()) {
      window.emplace(std::move(*opened));
    } else {
      spdlog::info("projector: {}; pictures go to the job's folder only", opened.error().text());
    }
  }
  while (!stopping(wiring)) {
    wiring.beat(ThreadName::Projector);
    const auto shown = wiring.shown.pop(std::chrono::milliseconds(100));
    if (window) window->pump();
    if (!shown) continue;
    if (window && !shown->drawing) window->blank();
    if (!shown->drawing) continue;
    if (window) {
      const Status status = window->show(*shown->drawing);
      if (!status.ok()) spdlog::warn("projector: {}", status.error().text());
    }
    const Status written =
        adapters::write_png(*shown->drawing, shown->folder + fmt::format("/guidance-{:02}.png", shown->step));
    if (!written.ok()) spdlog::warn("projector: {}", written.error().text());
  }
}

void run_solver(Wiring& wiring) {
  while (!stopping(wiring)) {
    wiring.beat(ThreadName::Solver);
    if (auto work = wiring.work.pop(std::chrono::milliseconds(100))) (*work)();
  }
}

}  // namespace weldcell::app
