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
  if (method_ == "GET") return answer({{"pnl-opmode", "opmode", {{"opmode", s_.operation_mode()}}}});
  // A virtual controller's key can be turned from here.
  const std::string wanted = form("opmode");
  if (!action_is("setopmode")) return fault(400, kRwsBadValue, "Invalid action");
  if (segments_.size() == 4 && segments_[3] == "acknowledge") return no_content();
  if (segments_.size() != 3 || (wanted != "auto" && wanted != "man" && wanted != "manf"))
    return fault(400, kRwsBadValue, "Invalid opmode");
  s_.set_auto(wanted == "auto");
  s_.manual_full_speed = wanted == "manf";
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
  if (segment(1) == "rmmp") return manual_privilege();
  if (method_ != "POST") return fault(404, kRwsNoResource, "Resource not found: " + path_);
  HttpReply reply;
  if (segments_.size() == 1) {
    const std::string locale = form("ulocale");
    if (form("username").empty() || (locale != "local" && locale != "remote"))
      return fault(400, kRwsBadValue, "Invalid user");
    reply.status = 201;
    return reply;
  }
  return fault(404, kRwsNoResource, "Resource not found: " + path_);
}

HttpReply RwsHandler::manual_privilege() {
  ManualPrivilege& asked = s_.rmmp;
  const bool own = asked.session == session_;
  if (method_ == "POST" && segment(2) == "cancel") {
    if (own) asked = {};
    return no_content();
  }
  if (method_ == "POST") {
    const std::string privilege = form("privilege");
    if (privilege != "modify" && privilege != "exec") return fault(400, kRwsBadValue, "Invalid privilege");
    if (asked.session != 0 && !own) return fault(403, kRwsHeldByOther, "Another client has asked");
    asked = {session_, privilege, 0};
    HttpReply reply;
    reply.status = 202;
    return reply;
  }
  if (segment(2) == "poll") {
    if (own) ++asked.polls;
    const char* const status = !own ? "NONE" : asked.granted() ? "GRANTED" : "PENDING";
    return answer({{"user-rmmp-poll", "rmmp", {{"status", status}}}});
  }
  const std::string privilege =
      asked.session == 0 ? "none" : (asked.granted() ? "" : "pending ") + asked.privilege;
  return answer(
      {{"user-rmmp", "rmmp", {{"userid", std::to_string(asked.session)}, {"privilege", privilege}}}});
}

HttpReply RwsHandler::mastership_with_id(const std::string& domain) {
  if (action_ == "request-with-id") {
    if (s_.mastership.contains(domain) && !holds(domain))
      return fault(403, kRwsHeldByOther, "Requested resource is held by someone else");
    s_.mastership[domain] = session_;
    const std::string id = std::to_string(s_.mastership_ids[domain] = ++s_.last_mastership_id);
    return answer({{"msh-resource", domain, {{"mastershipid", id}}}});
  }
  const auto given = s_.mastership_ids.find(domain);
  if (given == s_.mastership_ids.end() || form("mastershipid") != std::to_string(given->second))
    return fault(403, kRwsNoMastership, "Mastership of " + domain + " has another id");
  s_.mastership_ids.erase(given);
  s_.mastership.erase(domain);
  return no_content();
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
  const bool asks = action_is("request") || action_is("request-with-id");
  if (asks && !s_.truth.auto_mode && !(s_.rmmp.granted() && s_.rmmp.session == session_))
    return fault(403, kRwsRejected, "Manual mode: remote mastership has to be granted at the pendant");
  if (action_is("request-with-id") || action_is("release-with-id"))
    return domain.empty() ? fault(400, kRwsBadValue, "A domain is needed") : mastership_with_id(domain);
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
