// The panel, mastership and users: what a person's side of the controller shows over RWS.
#include <algorithm>
#include <charconv>

#include "sim/controller_state.hpp"
#include "sim/rws_handler.hpp"

namespace weldcell::sim {

using ports::HttpReply;

HttpReply RwsHandler::set_motors() {
  const std::string wanted = form("ctrl-state");
  if (wanted != "motoron" && wanted != "motoroff")
    return fault(400, kRwsBadValue, "Invalid ctrl-state '" + wanted + "'");
  if (!s_.truth.auto_mode) return fault(403, kRwsRejected, "Motors can be switched remotely in AUTO only");
  if (s_.panel == PanelState::GuardStop || s_.panel == PanelState::EmergencyStop) {
    return fault(403, kRwsRejected, std::string("Motors stay off in state ") + to_string(s_.panel));
  }
  s_.set_panel(wanted == "motoron" ? PanelState::MotorsOn : PanelState::MotorsOff);
  return no_content();
}

HttpReply RwsHandler::operation_mode() {
  if (method_ == "GET")
    return answer({{"pnl-opmode", "opmode", {{"opmode", s_.truth.auto_mode ? "AUTO" : "MANR"}}}});
  // A virtual controller's key can be turned from here.
  const std::string wanted = form("opmode");
  if (!action_is("setopmode") || segments_.size() != 3 || (wanted != "auto" && wanted != "man"))
    return fault(400, kRwsBadValue, "Invalid opmode");
  s_.set_auto(wanted == "auto");
  return no_content();
}

HttpReply RwsHandler::panel() {
  const std::string what = segment(2);
  if (what == "ctrlstate") {
    const std::string title = two() ? "ctrl-state" : "ctrlstate";
    if (method_ == "GET") return answer({{"pnl-ctrlstate", title, {{"ctrlstate", to_string(s_.panel)}}}});
    return action_is("setctrlstate") ? set_motors() : fault(400, kRwsBadValue, "Invalid action");
  }
  if (what == "opmode") return operation_mode();
  if (what == "coldetstate" && method_ == "GET") {
    // Controllers put a blank behind this type.
    return answer({{"coldetstate ", "coldetstate", {{"coldetstate", "INIT"}}}});
  }
  if (what == "speedratio") {
    if (method_ == "GET") {
      return answer({{"pnl-speedratio",
                      "speedratio",
                      {{"speedratio", std::to_string(static_cast<int>(s_.speed_ratio * 100 + 0.5))}}}});
    }
    int ratio = -1;
    const std::string text = form("speed-ratio");
    std::from_chars(text.data(), text.data() + text.size(), ratio);
    if (!action_is("setspeedratio") || ratio < 0 || ratio > 100)
      return fault(400, kRwsBadValue, "Invalid speed-ratio");
    if (two()) {
      if (const auto refused = no_edit_right()) return *refused;
    }
    s_.speed_ratio = ratio / 100.0;
    return no_content();
  }
  return fault(404, kRwsNoResource, "Resource not found: " + path_);
}

HttpReply RwsHandler::users() {
  if (method_ != "POST") return fault(404, kRwsNoResource, "Resource not found: " + path_);
  HttpReply reply;
  if (segments_.size() == 1) {
    const std::string locale = form("ulocale");
    if (form("username").empty() || (locale != "local" && locale != "remote"))
      return fault(400, kRwsBadValue, "Invalid user");
    reply.status = 201;
    return reply;
  }
  const std::string privilege = form("privilege");
  if (segment(1) != "rmmp" || (privilege != "modify" && privilege != "exec"))
    return fault(400, kRwsBadValue, "Invalid privilege");
  reply.status = 202;
  return reply;
}

HttpReply RwsHandler::mastership() {
  const std::string domain = segment(2);
  const std::vector<std::string> all =
      two() ? std::vector<std::string>{"edit", "motion"} : std::vector<std::string>{"cfg", "motion", "rapid"};
  std::vector<std::string> wanted = domain.empty() ? all : std::vector<std::string>{domain};
  if (std::find(all.begin(), all.end(), wanted[0]) == all.end()) {
    return fault(404, kRwsNoResource, "No mastership domain " + domain);
  }
  if (method_ == "GET") {
    Items items;
    for (const std::string& one : wanted) {
      const bool held = s_.mastership.contains(one);
      items.push_back({"msh-resource",
                       one,
                       {{"mastership", held ? "remote" : "nomaster"},
                        {"uid", held ? std::to_string(s_.mastership[one]) : "0"},
                        {"application", held ? "RWS" : ""}}});
    }
    return answer(items);
  }
  if (action_is("request")) {
    for (const std::string& one : wanted) {
      if (s_.mastership.contains(one) && !holds(one)) {
        return fault(403, kRwsHeldByOther, "Requested resource is held by someone else");
      }
    }
    for (const std::string& one : wanted) s_.mastership[one] = session_;
    return no_content();
  }
  if (action_is("release")) {
    for (const std::string& one : wanted) {
      if (holds(one)) {
        s_.mastership.erase(one);
      } else if (!domain.empty()) {
        return fault(403, kRwsNoMastership, "Mastership of " + one + " is not held");
      }
    }
    return no_content();
  }
  return fault(400, kRwsBadValue, "Invalid action");
}

}  // namespace weldcell::sim
