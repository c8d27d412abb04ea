#include "weldcell/adapters/rws_client.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>

#include "rws_replies.hpp"

namespace weldcell::adapters {
namespace {

std::string text_or(const RwsState& state, const char* key) {
  const auto found = state.find(key);
  return found == state.end() ? std::string() : found->second;
}

int number_or(const RwsState& state, const char* key, int otherwise) {
  const std::string text = text_or(state, key);
  int value = otherwise;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

Error unexpected(const std::string& path, const std::string& what) {
  return {"rws.unexpected", "rws GET " + path, what, "check that rws.host is an IRC5 with RobotWare 6"};
}

std::string file_url(std::string_view path) { return "/fileservice/" + std::string(path); }
std::string task_url(std::string_view task) { return "/rw/rapid/tasks/" + std::string(task); }
std::string symbol_url(std::string_view task, std::string_view module, std::string_view symbol) {
  return "/rw/rapid/symbol/data/RAPID/" + std::string(task) + "/" + std::string(module) + "/" +
         std::string(symbol);
}

}  // namespace

const char* to_string(ControllerState state) {
  switch (state) {
    case ControllerState::Init:
      return "init";
    case ControllerState::MotorsOff:
      return "motors off";
    case ControllerState::MotorsOn:
      return "motors on";
    case ControllerState::GuardStop:
      return "guard stop";
    case ControllerState::EmergencyStop:
      return "emergency stop";
    case ControllerState::EmergencyStopReset:
      return "emergency stop reset";
    case ControllerState::SystemFailure:
      return "system failure";
    case ControllerState::Unknown:
      break;
  }
  return "unknown";
}

const char* to_string(OperationMode mode) {
  switch (mode) {
    case OperationMode::Init:
      return "init";
    case OperationMode::ChangingToAuto:
      return "changing to automatic";
    case OperationMode::ChangingToManualFull:
      return "changing to manual full speed";
    case OperationMode::ManualReduced:
      return "manual reduced speed";
    case OperationMode::ManualFull:
      return "manual full speed";
    case OperationMode::Auto:
      return "automatic";
    case OperationMode::Unknown:
      break;
  }
  return "unknown";
}

const char* to_string(ExecutionState state) {
  switch (state) {
    case ExecutionState::Stopped:
      return "stopped";
    case ExecutionState::Running:
      return "running";
    case ExecutionState::Unknown:
      break;
  }
  return "unknown";
}

const char* to_string(MastershipDomain domain) {
  switch (domain) {
    case MastershipDomain::Cfg:
      return "cfg";
    case MastershipDomain::Motion:
      return "motion";
    case MastershipDomain::Rapid:
      break;
  }
  return "rapid";
}

MastershipLease::~MastershipLease() {
  if (client_ != nullptr) static_cast<void>(client_->release_mastership(domain_));
}

Status MastershipLease::release() {
  if (client_ == nullptr) return Done{};
  return std::exchange(client_, nullptr)->release_mastership(domain_);
}

Result<ports::HttpReply> RwsClient::checked(ports::HttpRequest request) {
  const std::string name = request.method + " " + request.path;
  auto reply = transport_->exchange(request);
  if (!reply.ok()) return reply.error();
  if (reply->status < 200 || reply->status >= 300) return rws_error(*reply, name);
  return reply;
}

Result<ports::HttpReply> RwsClient::get(std::string path) {
  return checked({"GET", std::move(path), "", ""});
}

Result<ports::HttpReply> RwsClient::post(std::string path, std::string body) {
  return checked({"POST", std::move(path), std::move(body)});
}

Status RwsClient::command(std::string path, std::string body) {
  auto reply = post(std::move(path), std::move(body));
  if (!reply.ok()) return reply.error();
  return Done{};
}

Result<std::string> RwsClient::field(std::string path, std::string_view type, std::string_view name) {
  const auto reply = get(path);
  if (!reply.ok()) return reply.error();
  const std::string key(name);
  for (const RwsState& state : rws_states(reply->body)) {
    if (text_or(state, "_type") == type && state.contains(key)) return state.at(key);
  }
  return unexpected(path, "the answer has no " + std::string(type) + "." + key);
}

Result<SystemInfo> RwsClient::system() {
  const std::string path = "/rw/system?json=1";
  const auto reply = get(path);
  if (!reply.ok()) return reply.error();
  SystemInfo out;
  bool found = false;
  for (const RwsState& state : rws_states(reply->body)) {
    if (text_or(state, "_type").starts_with("sys-system")) {
      out.name = text_or(state, "name");
      out.rapid_version = text_or(state, "rwversion");
      out.system_id = text_or(state, "sysid");
      found = true;
    }
    if (const std::string option = text_or(state, "option"); !option.empty()) out.options.push_back(option);
  }
  if (!found) return unexpected(path, "the answer has no sys-system");
  return out;
}

Result<ControllerState> RwsClient::controller_state() {
  const auto text = field("/rw/panel/ctrlstate?json=1", "pnl-ctrlstate", "ctrlstate");
  if (!text.ok()) return text.error();
  constexpr std::pair<std::string_view, ControllerState> kStates[] = {
      {"init", ControllerState::Init},
      {"motoroff", ControllerState::MotorsOff},
      {"motoron", ControllerState::MotorsOn},
      {"guardstop", ControllerState::GuardStop},
      {"emergencystop", ControllerState::EmergencyStop},
      {"emergencystopreset", ControllerState::EmergencyStopReset},
      {"sysfail", ControllerState::SystemFailure}};
  for (const auto& [name, state] : kStates)
    if (*text == name) return state;
  return ControllerState::Unknown;
}

Result<OperationMode> RwsClient::operation_mode() {
  const auto text = field("/rw/panel/opmode?json=1", "pnl-opmode", "opmode");
  if (!text.ok()) return text.error();
  constexpr std::pair<std::string_view, OperationMode> kModes[] = {
      {"INIT", OperationMode::Init},
      {"AUTO_CH", OperationMode::ChangingToAuto},
      {"MANF_CH", OperationMode::ChangingToManualFull},
      {"MANR", OperationMode::ManualReduced},
      {"MANF", OperationMode::ManualFull},
      {"AUTO", OperationMode::Auto}};
  for (const auto& [name, mode] : kModes)
    if (*text == name) return mode;
  return OperationMode::Unknown;
}

Result<ExecutionState> RwsClient::execution_state() {
  const auto text = field("/rw/rapid/execution?json=1", "rap-execution", "ctrlexecstate");
  if (!text.ok()) return text.error();
  if (*text == "running") return ExecutionState::Running;
  return *text == "stopped" ? ExecutionState::Stopped : ExecutionState::Unknown;
}

Result<int> RwsClient::speed_ratio_percent() {
  const auto text = field("/rw/panel/speedratio?json=1", "pnl-speedratio", "speedratio");
  if (!text.ok()) return text.error();
  return std::atoi(text->c_str());
}

Status RwsClient::set_motors(bool on) {
  return command("/rw/panel/ctrlstate?action=setctrlstate",
                 on ? "ctrl-state=motoron" : "ctrl-state=motoroff");
}

Status RwsClient::start(bool forever) {
  return command("/rw/rapid/execution?action=start",
                 std::string("regain=continue&execmode=continue&cycle=") + (forever ? "forever" : "once") +
                     "&condition=none&stopatbp=disabled&alltaskbytsp=false");
}

Status RwsClient::stop() { return command("/rw/rapid/execution?action=stop", "stopmode=stop"); }
Status RwsClient::reset_pp() { return command("/rw/rapid/execution?action=resetpp", ""); }

Status RwsClient::set_pp_to_routine(std::string_view task, std::string_view module,
                                    std::string_view routine) {
  return command(task_url(task) + "/pcp?action=set-pp-routine",
                 "module=" + form_value(module) + "&routine=" + form_value(routine));
}

Status RwsClient::request_mastership(MastershipDomain domain) {
  return command(std::string("/rw/mastership/") + to_string(domain) + "?action=request", "");
}

Status RwsClient::release_mastership(MastershipDomain domain) {
  return command(std::string("/rw/mastership/") + to_string(domain) + "?action=release", "");
}

Result<MastershipLease> RwsClient::lease(MastershipDomain domain) {
  if (auto taken = request_mastership(domain); !taken.ok()) return taken.error();
  return MastershipLease(*this, domain);
}

Status RwsClient::upload_file(std::string_view path, std::string_view text) {
  const auto put = checked({"PUT", file_url(path), std::string(text), "text/plain"});
  if (!put.ok()) return put.error();
  const auto back = download_file(path);
  if (!back.ok()) return back.error();
  if (*back == text) return Done{};
  const auto differs = std::ranges::mismatch(*back, text);
  return Error{"rws.mismatch", "rws " + std::string(path),
               "the controller's file differs from what was sent at byte " +
                   std::to_string(differs.in1 - back->begin()) + " (" + std::to_string(back->size()) +
                   " of " + std::to_string(text.size()) + " bytes)",
               "check the controller's disk and that no other client writes this file"};
}

Result<std::string> RwsClient::download_file(std::string_view path) {
  auto reply = get(file_url(path));
  if (!reply.ok()) return reply.error();
  return std::move(reply->body);
}

Status RwsClient::delete_file(std::string_view path) {
  const auto reply = checked({"DELETE", file_url(path), "", ""});
  if (!reply.ok()) return reply.error();
  return Done{};
}

Status RwsClient::make_folder(std::string_view parent, std::string_view name) {
  return command(file_url(parent), "fs-action=create&fs-newname=" + form_value(name));
}

Status RwsClient::load_module(std::string_view task, std::string_view path, bool replace) {
  return command(task_url(task) + "?action=loadmod",
                 "modulepath=" + form_value(path) + "&replace=" + (replace ? "true" : "false"));
}

Status RwsClient::unload_module(std::string_view task, std::string_view module) {
  return command(task_url(task) + "?action=unloadmod", "module=" + form_value(module));
}

Result<std::vector<std::string>> RwsClient::modules(std::string_view task) {
  const auto reply = get("/rw/rapid/modules?task=" + std::string(task) + "&json=1");
  if (!reply.ok()) return reply.error();
  std::vector<std::string> out;
  for (const RwsState& state : rws_states(reply->body)) {
    if (text_or(state, "_type") == "rap-module-info-li") out.push_back(text_or(state, "name"));
  }
  return out;
}

Result<std::string> RwsClient::read_symbol(std::string_view task, std::string_view module,
                                           std::string_view symbol) {
  return field(symbol_url(task, module, symbol) + "?json=1", "rap-data", "value");
}

Status RwsClient::write_symbol(std::string_view task, std::string_view module, std::string_view symbol,
                               std::string_view literal) {
  return command(symbol_url(task, module, symbol) + "?action=set", "value=" + form_value(literal));
}

Result<std::array<double, 6>> RwsClient::joints_deg(std::string_view mechanical_unit) {
  const std::string path =
      "/rw/motionsystem/mechunits/" + std::string(mechanical_unit) + "/jointtarget?json=1";
  const auto reply = get(path);
  if (!reply.ok()) return reply.error();
  for (const RwsState& state : rws_states(reply->body)) {
    if (text_or(state, "_type") != "ms-jointtarget") continue;
    std::array<double, 6> out{};
    for (std::size_t axis = 0; axis < out.size(); ++axis) {
      const std::string text = text_or(state, ("rax_" + std::to_string(axis + 1)).c_str());
      const auto parsed = std::from_chars(text.data(), text.data() + text.size(), out[axis]);
      if (text.empty() || parsed.ec != std::errc())
        return unexpected(path, "axis value '" + text + "' is no number");
    }
    return out;
  }
  return unexpected(path, "the answer has no ms-jointtarget");
}

Result<std::vector<ControllerEvent>> RwsClient::event_log(int count) {
  const auto reply = get("/rw/elog/0?lang=en&json=1");
  if (!reply.ok()) return reply.error();
  std::vector<ControllerEvent> out;
  for (const RwsState& state : rws_states(reply->body)) {
    if (!text_or(state, "_type").starts_with("elog-message")) continue;
    ControllerEvent event;
    const std::string place = text_or(state, "_title");
    event.number =
        static_cast<std::uint32_t>(std::strtoul(place.c_str() + place.rfind('/') + 1, nullptr, 10));
    event.type = number_or(state, "msgtype", 0);
    event.code = number_or(state, "code", 0);
    event.time = text_or(state, "tstamp");
    event.title = text_or(state, "title");
    event.description = text_or(state, "desc");
    event.causes = text_or(state, "causes");
    event.actions = text_or(state, "actions");
    out.push_back(std::move(event));
  }
  std::ranges::sort(out, std::greater(), &ControllerEvent::number);
  if (out.size() > static_cast<std::size_t>(std::max(count, 0)))
    out.resize(static_cast<std::size_t>(std::max(count, 0)));
  return out;
}

}  // namespace weldcell::adapters
