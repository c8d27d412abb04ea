#include <spdlog/spdlog.h>

#include <chrono>
#include <optional>
#include <thread>

#include "app/device_threads.hpp"
#include "weldcell/adapters/host_clock.hpp"
#include "weldcell/adapters/rws_http.hpp"
#include "weldcell/app/controller_watch.hpp"
#include "weldcell/app/robot_runner.hpp"

namespace weldcell::app {

namespace {

constexpr std::chrono::milliseconds kPace{20}, kIdlePace{100};

bool stopping(const Wiring& wiring) { return wiring.stopping.load(std::memory_order_relaxed); }

adapters::RwsAccess access_of(const files::CellConfig& config, const std::string& password) {
  adapters::RwsAccess access;
  access.host = config.rws.host;
  access.port = config.rws.port;
  access.certificate_sha256 = config.rws_certificate_sha256;
  access.user = config.rws_user;
  access.session_file = config.state_dir + "/rws-session";
  access.password = password;
  if (config.rws_generation == files::RwsGenerationChoice::Two) access.generation = wire::RwsGeneration::Two;
  return access;
}

/// With `generation: auto` asks until something answers; empty when the daemon stops.
std::optional<wire::RwsGeneration> find_generation(Wiring& wiring, const adapters::RwsAccess& access) {
  if (wiring.config.rws_generation != files::RwsGenerationChoice::Auto) return access.generation;
  std::string told;
  while (!stopping(wiring)) {
    const auto found = adapters::find_rws_generation(access);
    wiring.beat(ThreadName::Rws);
    if (found.ok()) {
      spdlog::info("robot controller: speaks {}", wire::to_string(*found));
      return *found;
    }
    if (told != found.error().text()) {
      told = found.error().text();
      spdlog::warn("robot controller: {}; trying again", told);
      report_link(wiring, job::Link::Rws, false, told);
    }
    for (int i = 0; i < 20 && !stopping(wiring); ++i) {
      wiring.beat(ThreadName::Rws);
      std::this_thread::sleep_for(kIdlePace);
    }
  }
  return std::nullopt;
}

/// Tells link changes to the cell and the controller's warnings and errors to the log.
void report(Wiring& wiring, ControllerWatch& watch, std::optional<bool>& link) {
  const ControllerView& view = watch.view();
  if (link != view.reachable) {
    // The cell speaks of links that come and go; the first failure of all is said here.
    if (!link && !view.reachable) spdlog::warn("robot controller: {}; trying again", view.detail);
    link = view.reachable;
    report_link(wiring, job::Link::Rws, *link, view.detail);
  }
  for (const adapters::ControllerEvent& event : watch.take_events()) {
    if (event.type >= 2)
      spdlog::warn("robot controller: event {} {}: {}", event.code, event.title, event.description);
  }
  wiring.controller_state.store(view.controller, std::memory_order_relaxed);
  wiring.operation_mode.store(view.mode, std::memory_order_relaxed);
  wiring.execution_state.store(view.execution, std::memory_order_relaxed);
  wiring.rws_live.store(view.live, std::memory_order_relaxed);
}

}  // namespace

void run_rws(Wiring& wiring, const std::string& password, const ResidentModules& resident) {
  adapters::RwsAccess access = access_of(wiring.config, password);
  const auto generation = find_generation(wiring, access);
  if (!generation) return;
  access.generation = *generation;
  adapters::RwsHttp http(access);
  adapters::RwsClient rws(http, *generation);
  if (http.has_former_session()) {
    spdlog::info(
        "robot controller: the session of an earlier run is ended first, with the mastership it holds");
    rws.end_former_session_first([&http] { return http.logout(); });
  }
  ControllerWatch watch(rws, http);
  RobotRunner runner(rws, wiring.config.rws_task,
                     *generation == wire::RwsGeneration::Two ? resident.modx : resident.mod, &watch.view());
  std::optional<bool> link;
  const auto advance = [&] {
    if (const auto reply = runner.step(adapters::now())) wiring.inbox.push({*reply, nullptr, nullptr});
    watch.step(adapters::now());
    report(wiring, watch, link);
    if (const auto fault = http.take_session_fault()) spdlog::warn("robot controller: {}", fault->text());
    wiring.beat(ThreadName::Rws);
  };
  while (!stopping(wiring)) {
    if (auto request = wiring.robot_requests.pop(runner.busy() ? kPace : kIdlePace)) {
      // A stop never waits behind a move; a move never begins before the stop ahead of it has ended.
      while (runner.busy() && request->task != job::RobotTask::Stop && !stopping(wiring)) {
        advance();
        std::this_thread::sleep_for(kPace);
      }
      runner.begin(*request, adapters::now());
    }
    advance();
  }
}

}  // namespace weldcell::app
