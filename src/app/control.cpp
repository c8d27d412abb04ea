#include "app/control.hpp"

#include <nlohmann/json.hpp>

#include "weldcell/adapters/process_facts.hpp"

namespace weldcell::app {

namespace {

using nlohmann::json;

json egm_json(const EgmFigures& egm) {
  return {{"frames", egm.frames},
          {"utilization_percent", egm.utilization_percent},
          {"peak_utilization_percent", egm.peak_percent},
          {"overloaded_frames", egm.overloaded},
          {"motors", to_string(egm.motors)},
          {"motion_control", to_string(egm.mci)},
          {"rapid", to_string(egm.rapid)},
          {"converged", egm.converged},
          {"limited", egm.limited},
          {"stale", egm.stale},
          {"malformed", egm.malformed}};
}

std::string status_json(const Wiring& wiring) {
  const job::CellStatus s = wiring.status();
  json links;
  for (std::size_t i = 0; i < job::kLinks; ++i) links[job::to_string(static_cast<job::Link>(i))] = s.links[i];
  return json{
      {"ok", true},
      {"state", job::to_string(s.state)},
      {"phase", static_cast<int>(s.state)},
      {"armed", s.armed},
      {"job", s.job},
      {"guide_step", s.guide_step},
      {"guide_steps", s.guide_steps},
      {"progress", s.progress},
      {"pass", s.pass},
      {"seams_done", s.seams_done},
      {"seams", s.seams},
      {"fault", s.fault_text},
      {"jobs_waiting", wiring.jobs_waiting.load()},
      {"selected_job", wiring.selected_job.load()},
      {"spool_fault", wiring.spool_fault()},
      {"fault_code", static_cast<int>(s.fault)},
      {"links", links},
      {"controller",
       {{"state", wire::to_string(wiring.controller_state.load())},
        {"mode", wire::to_string(wiring.operation_mode.load())},
        {"execution", wire::to_string(wiring.execution_state.load())},
        {"subscribed", wiring.rws_live.load()}}},
      {"egm", egm_json(wiring.egm_figures())},
      {"ports", {{"egm", wiring.egm_port.load()}, {"modbus", wiring.modbus_port.load()}}},
      {"rss_kb", adapters::rss_kb()},
      {"cpu_seconds", adapters::cpu_seconds()},
      {"threads", adapters::thread_count()},
      {"dropped",
       {{"egm", wiring.egm.dropped()}, {"laser", wiring.laser.dropped()}, {"inbox", wiring.inbox.refused()}}}}
      .dump();
}

std::optional<wire::PlcCommand> order_of(const std::string& word) {
  using wire::PlcCommand;
  static const std::pair<const char*, PlcCommand> kOrders[] = {
      {"arm", PlcCommand::Arm},     {"start", PlcCommand::Start},   {"confirm", PlcCommand::Confirm},
      {"stop", PlcCommand::Stop},   {"resume", PlcCommand::Resume}, {"reset", PlcCommand::Reset},
      {"abort", PlcCommand::Abort}, {"hold", PlcCommand::Hold},     {"unhold", PlcCommand::Unhold},
      {"clear", PlcCommand::Clear}};
  for (const auto& [name, order] : kOrders) {
    if (word == name) return order;
  }
  return std::nullopt;
}

std::string answer(Wiring& wiring, const adapters::ControlRequest& request) {
  if (request.command == "status") return status_json(wiring);
  const auto order = order_of(request.command);
  if (!order) return json{{"ok", false}, {"error", "unknown order '" + request.command + "'"}}.dump();
  auto outcome = std::make_shared<std::promise<std::string>>();
  auto told = outcome->get_future();
  const std::string who = "uid " + std::to_string(request.peer_uid);
  if (!wiring.inbox.push({job::OperatorCommand{*order, who}, nullptr, outcome})) {
    return json{{"ok", false}, {"error", "the cell is overloaded"}}.dump();
  }
  if (told.wait_for(std::chrono::seconds(2)) != std::future_status::ready) {
    return json{{"ok", false}, {"error", "the cell does not answer"}}.dump();
  }
  const std::string refused = told.get();
  return refused.empty() ? json{{"ok", true}}.dump() : json{{"ok", false}, {"error", refused}}.dump();
}

}  // namespace

Result<adapters::ControlSocket> open_control(Wiring& wiring) {
  return adapters::ControlSocket::listen(
      wiring.config.state_dir + "/weldcelld.sock",
      [&wiring](const adapters::ControlRequest& request) { return answer(wiring, request); });
}

}  // namespace weldcell::app
