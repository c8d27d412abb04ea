#include "weldcell/adapters/rws_client.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdlib>

namespace weldcell::adapters {
namespace {

using wire::rws_field;
using wire::rws_states;
using wire::RwsAsk;
using wire::RwsState;

constexpr int kMostPages = 200;

int number_or(const RwsState& state, const char* key, int otherwise) {
  const std::string text = rws_field(state, key);
  int value = otherwise;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

Error unexpected(const std::string& path, const std::string& what) {
  return {"rws.unexpected", "rws GET " + path, what,
          "check rws.address and rws.generation: 1 for IRC5, 2 for OmniCore"};
}

std::string header(const ports::HttpReply& reply, const char* name) {
  for (const auto& [key, value] : reply.headers) {
    if (std::ranges::equal(key, std::string_view(name),
                           [](char a, char b) { return std::tolower(static_cast<unsigned char>(a)) == b; }))
      return value;
  }
  return "";
}

ControllerEvent event_of(const RwsState& state) {
  ControllerEvent event;
  const std::string place = rws_field(state, "_title");
  event.number = static_cast<std::uint32_t>(std::strtoul(place.c_str() + place.rfind('/') + 1, nullptr, 10));
  event.type = number_or(state, "msgtype", 0);
  event.code = number_or(state, "code", 0);
  event.time = rws_field(state, "tstamp");
  event.title = rws_field(state, "title");
  event.description = rws_field(state, "desc");
  event.causes = rws_field(state, "causes");
  event.actions = rws_field(state, "actions");
  return event;
}

}  // namespace

MastershipLease::~MastershipLease() {
  if (client_ != nullptr) static_cast<void>(client_->release_mastership(domain_));
}

Status MastershipLease::release() {
  if (client_ == nullptr) return Done{};
  return std::exchange(client_, nullptr)->release_mastership(domain_);
}

Status RwsClient::end_former_session() {
  const RwsAsk ask = dialect_.release_mastership(MastershipDomain::Rapid);
  const auto released = transport_->exchange({ask.method, ask.path, ask.body, ask.content_type, ask.accept});
  if (!released.ok()) return released.error();
  // Any other refusal will do: that session held nothing, or the controller knows it no longer.
  if (released->status == 503) return wire::rws_refusal(released->status, released->body, ask.path);
  if (auto ended = end_former_(); !ended.ok()) return ended;
  end_former_ = nullptr;
  return Done{};
}

Result<ports::HttpReply> RwsClient::checked(RwsAsk ask) {
  if (end_former_) {
    if (auto ended = end_former_session(); !ended.ok()) return ended.error();
  }
  const std::string name = ask.method + " " + ask.path;
  const bool hal = ask.accept.find("hal+json") != std::string::npos;
  ports::HttpRequest request{ask.method, ask.path, ask.body, ask.content_type, ask.accept};
  auto reply = transport_->exchange(request);
  if (reply.ok() && reply->status == 406 && hal) {
    dialect_.without_hal();
    request.accept = dialect_.system().accept;
    reply = transport_->exchange(request);
  }
  if (!reply.ok()) return reply.error();
  if (reply->status < 200 || reply->status >= 300) return wire::rws_refusal(reply->status, reply->body, name);
  return reply;
}

Status RwsClient::command(RwsAsk ask) {
  auto reply = checked(std::move(ask));
  if (!reply.ok()) return reply.error();
  return Done{};
}

Result<std::string> RwsClient::field(RwsAsk ask, std::string_view type, std::string_view name) {
  const std::string path = ask.path;
  const auto reply = checked(std::move(ask));
  if (!reply.ok()) return reply.error();
  const std::string key(name);
  for (const RwsState& state : rws_states(reply->body)) {
    if (rws_field(state, "_type") == type && state.contains(key)) return state.at(key);
  }
  return unexpected(path, "the answer has no " + std::string(type) + "." + key);
}

Result<SystemInfo> RwsClient::system() {
  const RwsAsk ask = dialect_.system();
  const auto reply = checked(ask);
  if (!reply.ok()) return reply.error();
  SystemInfo out;
  bool found = false;
  for (const RwsState& state : rws_states(reply->body)) {
    if (rws_field(state, "_type").starts_with("sys-system")) {
      out.name = rws_field(state, "name");
      out.rapid_version = rws_field(state, "rwversion");
      out.system_id = rws_field(state, "sysid");
      found = true;
    }
    if (const std::string option = rws_field(state, "option"); !option.empty()) out.options.push_back(option);
  }
  if (!found) return unexpected(ask.path, "the answer has no sys-system");
  return out;
}

Result<ControllerState> RwsClient::controller_state() {
  const auto text = field(dialect_.controller_state(), "pnl-ctrlstate", "ctrlstate");
  if (!text.ok()) return text.error();
  return wire::controller_state_of(*text);
}

Result<OperationMode> RwsClient::operation_mode() {
  const auto text = field(dialect_.operation_mode(), "pnl-opmode", "opmode");
  if (!text.ok()) return text.error();
  return wire::operation_mode_of(*text);
}

Result<ExecutionState> RwsClient::execution_state() {
  const auto text = field(dialect_.execution(), "rap-execution", "ctrlexecstate");
  if (!text.ok()) return text.error();
  return wire::execution_state_of(*text);
}

Result<int> RwsClient::speed_ratio_percent() {
  const auto text = field(dialect_.speed_ratio(), "pnl-speedratio", "speedratio");
  if (!text.ok()) return text.error();
  return std::atoi(text->c_str());
}

Status RwsClient::set_motors(bool on) { return command(dialect_.set_motors(on)); }
Status RwsClient::set_speed_ratio_percent(int percent) { return command(dialect_.set_speed_ratio(percent)); }
Status RwsClient::start(bool forever) { return command(dialect_.start(forever)); }
Status RwsClient::stop() { return command(dialect_.stop()); }
Status RwsClient::reset_pp() { return command(dialect_.reset_pp()); }

Result<std::string> RwsClient::pointer_module(std::string_view task) {
  // "modulemame" is the controllers' own spelling.
  return field(dialect_.program_pointer(task), "pcp-info", "modulemame");
}

Status RwsClient::set_pp_to_routine(std::string_view task, std::string_view module,
                                    std::string_view routine) {
  return command(dialect_.set_pp_to_routine(task, module, routine));
}

Status RwsClient::request_mastership(MastershipDomain domain) {
  return command(dialect_.request_mastership(domain));
}

Status RwsClient::release_mastership(MastershipDomain domain) {
  return command(dialect_.release_mastership(domain));
}

Result<MastershipLease> RwsClient::lease(MastershipDomain domain) {
  if (auto taken = request_mastership(domain); !taken.ok()) return taken.error();
  return MastershipLease(*this, domain);
}

Status RwsClient::upload_file(std::string_view path, std::string_view text) {
  if (auto put = command(dialect_.write_file(path, text)); !put.ok()) return put;
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
  auto reply = checked(dialect_.read_file(path));
  if (!reply.ok()) return reply.error();
  return std::move(reply->body);
}

Status RwsClient::delete_file(std::string_view path) { return command(dialect_.delete_file(path)); }

Status RwsClient::make_folder(std::string_view parent, std::string_view name) {
  return command(dialect_.make_folder(parent, name));
}

Status RwsClient::load_module(std::string_view task, std::string_view path, bool replace) {
  return command(dialect_.load_module(task, path, replace));
}

Status RwsClient::unload_module(std::string_view task, std::string_view module) {
  return command(dialect_.unload_module(task, module));
}

Result<std::vector<std::string>> RwsClient::modules(std::string_view task) {
  const auto reply = checked(dialect_.modules(task));
  if (!reply.ok()) return reply.error();
  std::vector<std::string> out;
  for (const RwsState& state : rws_states(reply->body)) {
    if (rws_field(state, "_type") == "rap-module-info-li") out.push_back(rws_field(state, "name"));
  }
  return out;
}

Result<std::string> RwsClient::module_text(std::string_view task, std::string_view module) {
  return field(dialect_.module_text(task, module), "rap-module-text", "module-text");
}

Result<std::string> RwsClient::read_symbol(std::string_view task, std::string_view module,
                                           std::string_view symbol) {
  return field(dialect_.read_symbol(task, module, symbol), "rap-data", "value");
}

Status RwsClient::write_symbol(std::string_view task, std::string_view module, std::string_view symbol,
                               std::string_view literal) {
  return command(dialect_.write_symbol(task, module, symbol, literal));
}

Result<std::vector<SymbolFound>> RwsClient::search_symbols(std::string_view task, std::string_view module,
                                                           std::string_view pattern) {
  const auto reply = checked(dialect_.search_symbols(task, module, pattern));
  if (!reply.ok()) return reply.error();
  std::vector<SymbolFound> out;
  for (const RwsState& state : rws_states(reply->body)) {
    if (rws_field(state, "_type").starts_with("rap-symprop"))
      out.push_back({rws_field(state, "symburl"), rws_field(state, "dattyp")});
  }
  return out;
}

Result<std::vector<IoSignal>> RwsClient::signals() {
  std::vector<IoSignal> out;
  std::string next;
  for (int page = 0; page < kMostPages; ++page) {
    const auto reply = checked(dialect_.signals(next));
    if (!reply.ok()) return reply.error();
    for (const RwsState& state : rws_states(reply->body)) {
      if (rws_field(state, "_type") != "ios-signal-li") continue;
      std::string place = rws_field(state, "_title");
      if (place.empty()) place = rws_field(state, "name");
      out.push_back(
          {rws_field(state, "name"), rws_field(state, "type"), std::move(place), rws_field(state, "lvalue")});
    }
    std::string following = wire::rws_next_page(reply->body);
    if (following.empty() || following == next) return out;
    next = std::move(following);
  }
  return unexpected("/rw/iosystem/signals", "the list of signals does not end");
}

Result<std::string> RwsClient::read_signal(std::string_view place) {
  const RwsAsk ask = dialect_.read_signal(place);
  const auto reply = checked(ask);
  if (!reply.ok()) return reply.error();
  for (const RwsState& state : rws_states(reply->body)) {
    // A single signal is an entry of its own type or of the list's, by firmware.
    if (rws_field(state, "_type").starts_with("ios-signal") && state.contains("lvalue"))
      return state.at("lvalue");
  }
  return unexpected(ask.path, "the answer has no ios-signal.lvalue");
}

Status RwsClient::write_signal(std::string_view place, std::string_view value) {
  return command(dialect_.write_signal(place, value));
}

Result<std::array<double, 6>> RwsClient::joints_deg(std::string_view mechanical_unit) {
  const RwsAsk ask = dialect_.joints(mechanical_unit);
  const auto reply = checked(ask);
  if (!reply.ok()) return reply.error();
  for (const RwsState& state : rws_states(reply->body)) {
    if (rws_field(state, "_type") != "ms-jointtarget") continue;
    std::array<double, 6> out{};
    for (std::size_t axis = 0; axis < out.size(); ++axis) {
      const std::string text = rws_field(state, ("rax_" + std::to_string(axis + 1)).c_str());
      const auto parsed = std::from_chars(text.data(), text.data() + text.size(), out[axis]);
      if (text.empty() || parsed.ec != std::errc())
        return unexpected(ask.path, "axis value '" + text + "' is no number");
    }
    return out;
  }
  return unexpected(ask.path, "the answer has no ms-jointtarget");
}

Result<std::vector<ControllerEvent>> RwsClient::event_log(int count) {
  const auto reply = checked(dialect_.event_log(count));
  if (!reply.ok()) return reply.error();
  std::vector<ControllerEvent> out;
  for (const RwsState& state : rws_states(reply->body)) {
    if (rws_field(state, "_type").starts_with("elog-message")) out.push_back(event_of(state));
  }
  std::ranges::sort(out, std::greater(), &ControllerEvent::number);
  if (out.size() > static_cast<std::size_t>(std::max(count, 0)))
    out.resize(static_cast<std::size_t>(std::max(count, 0)));
  return out;
}

Result<ControllerEvent> RwsClient::event(std::uint32_t number) {
  const RwsAsk ask = dialect_.event(number);
  const auto reply = checked(ask);
  if (!reply.ok()) return reply.error();
  for (const RwsState& state : rws_states(reply->body)) {
    if (!rws_field(state, "_type").starts_with("elog-message")) continue;
    ControllerEvent event = event_of(state);
    event.number = number;
    return event;
  }
  return unexpected(ask.path, "the answer has no elog-message");
}

Result<wire::RwsSubscribed> RwsClient::subscribe(const std::vector<wire::RwsResource>& resources) {
  const RwsAsk ask = dialect_.subscribe(resources);
  const auto reply = checked(ask);
  if (!reply.ok()) return reply.error();
  const auto made = wire::rws_subscribed(header(*reply, "location"), reply->body);
  if (!made) return unexpected(ask.path, "the answer names no WebSocket");
  return *made;
}

Status RwsClient::unsubscribe(std::string_view group) { return command(dialect_.unsubscribe(group)); }

}  // namespace weldcell::adapters
