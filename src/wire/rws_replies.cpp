#include "weldcell/wire/rws_replies.hpp"

#include <nlohmann/json.hpp>
#include <pugixml.hpp>

#include <charconv>
#include <cstring>

namespace weldcell::wire {

namespace {

using nlohmann::json;

constexpr int kDeepest = 64;

std::string text_of(const json& value) { return value.is_string() ? value.get<std::string>() : value.dump(); }

bool is_json(std::string_view body) {
  const std::size_t first = body.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && body[first] == '{';
}

/// The href of _links.<rel>, "" when there is none.
std::string link_of(const json& node, const char* rel) {
  const auto links = node.find("_links");
  if (links == node.end() || !links->is_object()) return "";
  const auto link = links->find(rel);
  if (link == links->end() || !link->is_object()) return "";
  const auto href = link->find("href");
  return href != link->end() && href->is_string() ? href->get<std::string>() : "";
}

void trim_type(RwsState& state) {
  // Some controllers put blanks behind the type.
  std::string& type = state["_type"];
  type.erase(type.find_last_not_of(' ') + 1);
}

void collect(const json& node, int depth, std::vector<RwsState>& out) {
  if (depth > kDeepest) return;
  if (node.is_array()) {
    for (const json& item : node) collect(item, depth + 1, out);
    return;
  }
  if (!node.is_object()) return;
  RwsState state;
  for (const auto& [key, value] : node.items()) {
    if (value.is_primitive())
      state[key] = text_of(value);
    else if (key != "_links")
      collect(value, depth + 1, out);
  }
  if (!state.contains("_type")) return;
  if (std::string self = link_of(node, "self"); !self.empty()) state["_self"] = std::move(self);
  trim_type(state);
  out.push_back(std::move(state));
}

/// Name of an element without its namespace's prefix.
const char* local_name(const pugi::xml_node& node) {
  const char* name = node.name();
  const char* colon = std::strchr(name, ':');
  return colon == nullptr ? name : colon + 1;
}
bool is(const pugi::xml_node& node, const char* name) { return std::strcmp(local_name(node), name) == 0; }

/// Visits every element without recursion, whatever the depth of the document.
template <typename Visit>
struct Walk final : pugi::xml_tree_walker {
  explicit Walk(Visit v) : visit(std::move(v)) {}
  bool for_each(pugi::xml_node& node) override {
    if (node.type() == pugi::node_element) visit(node);
    return true;
  }
  Visit visit;
};
template <typename Visit>
void walk(pugi::xml_document& document, Visit visit) {
  Walk<Visit> walker(std::move(visit));
  document.traverse(walker);
}

bool load(pugi::xml_document& document, std::string_view body) {
  return document.load_buffer(body.data(), body.size());
}

std::vector<RwsState> states_of_xhtml(std::string_view body) {
  std::vector<RwsState> out;
  pugi::xml_document document;
  if (!load(document, body)) return out;
  walk(document, [&out](const pugi::xml_node& node) {
    if (!is(node, "li") || *node.attribute("class").value() == '\0') return;
    RwsState state;
    for (const pugi::xml_node& child : node.children()) {
      if (is(child, "span")) {
        state[child.attribute("class").value()] = child.child_value();
      } else if (is(child, "a") && std::strcmp(child.attribute("rel").value(), "self") == 0) {
        state["_self"] = child.attribute("href").value();
      }
    }
    state["_type"] = node.attribute("class").value();
    state["_title"] = node.attribute("title").value();
    trim_type(state);
    out.push_back(std::move(state));
  });
  return out;
}

/// The href of the document's own link of that relation; those of list entries do not count.
std::string link_of_xhtml(std::string_view body, const char* rel) {
  std::string out;
  pugi::xml_document document;
  if (!load(document, body)) return out;
  walk(document, [&](const pugi::xml_node& node) {
    if (out.empty() && is(node, "a") && !is(node.parent(), "li") &&
        std::strcmp(node.attribute("rel").value(), rel) == 0) {
      out = node.attribute("href").value();
    }
  });
  return out;
}

template <typename Enum, std::size_t N>
Enum of(std::string_view word, const std::pair<std::string_view, Enum> (&words)[N]) {
  for (const auto& [name, value] : words) {
    if (name == word) return value;
  }
  return Enum::Unknown;
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

ControllerState controller_state_of(std::string_view word) {
  static constexpr std::pair<std::string_view, ControllerState> kWords[] = {
      {"init", ControllerState::Init},
      {"motoroff", ControllerState::MotorsOff},
      {"motoron", ControllerState::MotorsOn},
      {"guardstop", ControllerState::GuardStop},
      {"emergencystop", ControllerState::EmergencyStop},
      {"emergencystopreset", ControllerState::EmergencyStopReset},
      {"sysfail", ControllerState::SystemFailure}};
  return of(word, kWords);
}

OperationMode operation_mode_of(std::string_view word) {
  static constexpr std::pair<std::string_view, OperationMode> kWords[] = {
      {"INIT", OperationMode::Init},
      {"AUTO_CH", OperationMode::ChangingToAuto},
      {"MANF_CH", OperationMode::ChangingToManualFull},
      {"MANR", OperationMode::ManualReduced},
      {"MANF", OperationMode::ManualFull},
      {"AUTO", OperationMode::Auto}};
  return of(word, kWords);
}

ExecutionState execution_state_of(std::string_view word) {
  static constexpr std::pair<std::string_view, ExecutionState> kWords[] = {
      {"running", ExecutionState::Running}, {"stopped", ExecutionState::Stopped}};
  return of(word, kWords);
}

std::vector<RwsState> rws_states(std::string_view body) {
  if (!is_json(body)) return states_of_xhtml(body);
  std::vector<RwsState> out;
  const json root = json::parse(body, nullptr, false);
  if (root.is_object()) collect(root, 0, out);
  return out;
}

std::string rws_field(const RwsState& state, const char* key) {
  const auto found = state.find(key);
  return found == state.end() ? std::string() : found->second;
}

std::string rws_next_page(std::string_view body) {
  if (!is_json(body)) return link_of_xhtml(body, "next");
  const json root = json::parse(body, nullptr, false);
  if (!root.is_object()) return "";
  std::string href = link_of(root, "next");
  // Controllers write the ampersand of a query as in HTML, in JSON too.
  for (std::size_t at; (at = href.find("&amp;")) != std::string::npos;) href.erase(at + 1, 4);
  return href;
}

std::optional<RwsSubscribed> rws_subscribed(std::string_view location, std::string_view body) {
  constexpr std::string_view kPoll = "/poll/";
  RwsSubscribed out;
  std::string self = link_of_xhtml(body, "self"), group = link_of_xhtml(body, "group");
  for (const std::string_view place : {location, std::string_view(self)}) {
    const std::size_t at = place.find(kPoll);
    if (at == std::string_view::npos || at + kPoll.size() >= place.size()) continue;
    out.poll = std::string(place.substr(at));
    break;
  }
  if (out.poll.empty() || out.poll.find_first_of(" \t\r\n") != std::string::npos) return std::nullopt;
  const std::size_t slash = group.rfind('/');
  out.group = group.empty() ? out.poll.substr(kPoll.size())
                            : (slash == std::string::npos ? group : group.substr(slash + 1));
  return out;
}

RwsNews rws_news(std::string_view frame) {
  RwsNews out;
  for (const RwsState& state : rws_states(frame)) {
    const std::string type = rws_field(state, "_type");
    if (type == "pnl-ctrlstate-ev") {
      out.controller = controller_state_of(rws_field(state, "ctrlstate"));
    } else if (type == "pnl-opmode-ev") {
      out.mode = operation_mode_of(rws_field(state, "opmode"));
    } else if (type == "rap-ctrlexecstate-ev") {
      out.execution = execution_state_of(rws_field(state, "ctrlexecstate"));
    } else if (type == "elog-message-ev") {
      const std::string text = rws_field(state, "seqnum");
      std::uint32_t number = 0;
      const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
      if (read.ec == std::errc() && !text.empty()) out.log_entries.push_back(number);
    }
  }
  return out;
}

}  // namespace weldcell::wire
