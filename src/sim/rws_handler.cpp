#include "sim/rws_handler.hpp"

#include <charconv>
#include <nlohmann/json.hpp>

#include "sim/controller_state.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::sim {

using ports::HttpReply;

std::string url_decoded(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned byte = 0;
    if (text[i] == '%' && i + 2 < text.size() &&
        std::from_chars(&text[i + 1], &text[i + 1] + 2, byte, 16).ptr == &text[i + 1] + 2) {
      out += static_cast<char>(byte);
      i += 2;
    } else {
      out += text[i] == '+' ? ' ' : text[i];
    }
  }
  return out;
}

std::map<std::string, std::string> parse_form(std::string_view text) {
  std::map<std::string, std::string> out;
  while (!text.empty()) {
    const std::string_view pair = text.substr(0, text.find('&'));
    text.remove_prefix(std::min(text.size(), pair.size() + 1));
    const std::size_t equals = pair.find('=');
    const std::string_view key = pair.substr(0, equals);
    if (!key.empty()) {
      out[url_decoded(key)] = equals == std::string_view::npos ? "" : url_decoded(pair.substr(equals + 1));
    }
  }
  return out;
}

namespace {
std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string head(const std::string& title) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?><html "
         "xmlns=\"http://www.w3.org/1999/xhtml\"><head><title>" +
         title + "</title><base href=\"http://localhost/\"/></head><body>";
}
}  // namespace

HttpReply RwsHandler::answer(const Items& items) const {
  HttpReply reply;
  reply.status = 200;
  if (query("json") == "1") {
    nlohmann::ordered_json states = nlohmann::ordered_json::array();
    for (const Item& item : items) {
      nlohmann::ordered_json one{{"_type", item.type}, {"_title", item.title}};
      for (const auto& [key, value] : item.fields) one[key] = value;
      states.push_back(std::move(one));
    }
    nlohmann::ordered_json all;
    all["_links"]["base"]["href"] = "http://localhost" + path_.substr(0, path_.rfind('/') + 1);
    all["_embedded"]["_state"] = std::move(states);
    reply.headers["Content-Type"] = "application/json";
    reply.body = all.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
    return reply;
  }
  reply.headers["Content-Type"] = "application/xhtml+xml";
  reply.body = head(escaped(segment(0))) + "<div class=\"state\"><a href=\"" + escaped(path_) +
               "\" rel=\"self\"></a><ul>";
  for (const Item& item : items) {
    reply.body += "<li class=\"" + item.type + "\" title=\"" + escaped(item.title) + "\">";
    for (const auto& [key, value] : item.fields) {
      reply.body += "<span class=\"" + key + "\">" + escaped(value) + "</span>";
    }
    reply.body += "</li>";
  }
  reply.body += "</ul></div></body></html>";
  return reply;
}

HttpReply RwsHandler::fault(int status, long code, const std::string& text) const {
  HttpReply reply;
  reply.status = status;
  const std::string message = "rws_resource.cpp[547] " + text + " code:" + std::to_string(code) + " icode:-1";
  if (query("json") == "1") {
    nlohmann::ordered_json all;
    all["_links"]["base"]["href"] = "http://localhost/";
    all["_embedded"]["status"] = {{"code", code}, {"msg", message}};
    all["_embedded"]["_state"] = nlohmann::ordered_json::array();
    reply.headers["Content-Type"] = "application/json";
    reply.body = all.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  } else {
    reply.headers["Content-Type"] = "application/xhtml+xml";
    reply.body = head("error") + "<div class=\"status\"><span class=\"code\">" + std::to_string(code) +
                 "</span><span class=\"msg\">" + escaped(message) + "</span></div></body></html>";
  }
  return reply;
}

HttpReply RwsHandler::no_content() {
  HttpReply reply;
  reply.status = 204;
  return reply;
}

std::string RwsHandler::query(const std::string& key) const {
  const auto found = query_.find(key);
  return found == query_.end() ? "" : found->second;
}
std::string RwsHandler::form(const std::string& key) const {
  const auto found = form_.find(key);
  return found == form_.end() ? "" : found->second;
}
std::string RwsHandler::segment(std::size_t i) const { return i < segments_.size() ? segments_[i] : ""; }
bool RwsHandler::action_is(const std::string& wanted) const {
  return method_ == "POST" && query("action") == wanted;
}
bool RwsHandler::holds(const std::string& domain) const {
  const auto holder = s_.mastership.find(domain);
  return holder != s_.mastership.end() && holder->second == session_;
}

HttpReply RwsHandler::handle(const ports::HttpRequest& request) {
  method_ = request.method;
  body_ = request.body;
  const std::size_t mark = request.path.find('?');
  path_ = url_decoded(request.path.substr(0, mark));
  query_ = parse_form(mark == std::string::npos ? "" : std::string_view(request.path).substr(mark + 1));
  if (path_.rfind("/fileservice", 0) != 0) form_ = parse_form(body_);
  std::size_t at = 0;
  while (at < path_.size()) {
    const std::size_t next = std::min(path_.find('/', at), path_.size());
    if (next > at) segments_.push_back(path_.substr(at, next - at));
    at = next + 1;
  }
  if (s_.fault_until_s.contains("rws_503")) {
    HttpReply busy;
    busy.status = 503;
    busy.body = "Service Unavailable";
    return busy;
  }
  return route();
}

HttpReply RwsHandler::route() {
  const std::string &a = segment(0), &b = segment(1), &c = segment(2);
  if (a == "fileservice") return fileservice();
  if (a == "ctrl" && b == "identity") {
    return answer({{"ctrl-identity-info",
                    "identity",
                    {{"ctrl-name", "SIM_2600"}, {"ctrl-id", ""}, {"ctrl-type", "Virtual Controller"}}}});
  }
  if (a == "rw" && b == "panel") return panel();
  if (a == "rw" && b == "rapid") {
    if (c == "execution") return execution();
    if (c == "tasks") return tasks();
    if (c == "modules") return modules();
    if (c == "symbol" && segment(3) == "data") return symbol_data();
    if (c == "symbol" && segment(3) == "properties") return symbol_properties();
  }
  if (a == "rw" && b == "mastership") return mastership();
  if (a == "rw" && b == "motionsystem" && c == "mechunits") return mechunits();
  if (a == "rw" && b == "iosystem") return signals();
  if (a == "rw" && b == "elog") return elog();
  if (a == "rw" && b == "system") return system();
  if (a == "rw" && b == "retcode") return retcode();
  return fault(404, kRwsNoResource, "Resource not found: " + path_);
}

HttpReply RwsHandler::panel() {
  const std::string what = segment(2);
  if (what == "ctrlstate") {
    if (method_ == "GET")
      return answer({{"pnl-ctrlstate", "ctrlstate", {{"ctrlstate", to_string(s_.panel)}}}});
    if (!action_is("setctrlstate")) return fault(400, kRwsBadValue, "Invalid action");
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
  if (what == "opmode" && method_ == "GET") {
    return answer({{"pnl-opmode", "opmode", {{"opmode", s_.truth.auto_mode ? "AUTO" : "MANR"}}}});
  }
  if (what == "coldetstate" && method_ == "GET") {
    return answer({{"pnl-coldetstate", "coldetstate", {{"coldetstate", "INIT"}}}});
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
    s_.speed_ratio = ratio / 100.0;
    return no_content();
  }
  return fault(404, kRwsNoResource, "Resource not found: " + path_);
}

HttpReply RwsHandler::execution() {
  if (method_ == "GET") {
    return answer({{"rap-execution",
                    "execution",
                    {{"ctrlexecstate", s_.executing() ? "running" : "stopped"},
                     {"cycle", s_.task.forever() ? "forever" : "once"}}}});
  }
  if (action_is("start")) return start();
  if (action_is("stop")) {
    s_.stop_program("stopped by RWS");
    return no_content();
  }
  if (action_is("resetpp")) {
    if (s_.executing()) return fault(403, kRwsHeldByOther, "Program is executing");
    if (!s_.task.set_pointer("", "main")) return fault(400, kRwsWrongState, "No routine main");
    s_.path.reset(s_.reference);
    s_.egm_interrupted = false;
    return no_content();
  }
  if (action_is("setcycle")) {
    const std::string cycle = form("cycle");
    if (cycle != "once" && cycle != "forever") return fault(400, kRwsBadValue, "Invalid cycle");
    s_.task.set_forever(cycle == "forever");
    return no_content();
  }
  return fault(400, kRwsBadValue, "Invalid action");
}

HttpReply RwsHandler::start() {
  const auto in = [&](const char* key, std::initializer_list<const char*> allowed) {
    for (const char* value : allowed) {
      if (form(key) == value) return true;
    }
    return false;
  };
  if (!in("regain", {"continue", "regain", "clear", "enterconsume"}) ||
      !in("execmode", {"continue", "stepin", "stepover", "stepout", "stepback", "steplast", "stepmotion"}) ||
      !in("cycle", {"forever", "asis", "once"}) || !in("condition", {"none", "callchain"}) ||
      !in("stopatbp", {"enabled", "disabled"}) || !in("alltaskbytsp", {"true", "false"})) {
    return fault(400, kRwsBadValue, "Invalid or missing start argument");
  }
  if (!s_.truth.auto_mode) return fault(403, kRwsRejected, "Remote start needs AUTO");
  if (!s_.motors_on())
    return fault(400, kRwsWrongState, "Execution start refused: motors are off [org -508]");
  if (s_.executing())
    return fault(400, kRwsWrongState, "Execution start refused: already running [org -508]");
  if (!s_.task.has_pointer())
    return fault(400, kRwsWrongState, "Execution start refused: program pointer not set [org -508]");
  const std::string cycle = form("cycle");
  if (!s_.start_program(cycle == "forever" || (cycle == "asis" && s_.task.forever()))) {
    return fault(400, kRwsWrongState, "Execution start refused [org -508]");
  }
  return no_content();
}

HttpReply RwsHandler::tasks() {
  const std::string task = segment(3);
  if (task.empty()) {
    if (method_ != "GET") return fault(400, kRwsBadValue, "Invalid action");
    return answer({{"rap-task-li",
                    "T_ROB1",
                    {{"name", "T_ROB1"},
                     {"type", "normal"},
                     {"taskstate", s_.task.has_pointer() ? "linked" : "loaded"},
                     {"excstate", s_.task.running() ? "started" : "ready"},
                     {"active", "On"},
                     {"motiontask", "TRUE"}}}});
  }
  if (rapid::lower(task) != "t_rob1") return fault(404, kRwsBadValue, "Task " + task + " does not exist");
  if (segment(4) == "pcp") {
    if (method_ == "GET") {
      const auto at = s_.task.position();
      const std::string line = std::to_string(at.line);
      return answer({{"pcp-info",
                      "progpointer",
                      {{"modulemame", at.module},
                       {"routinename", at.routine},
                       {"beginposition", line + ",1"},
                       {"endposition", line + ",1"}}}});
    }
    return task_action(query("action"));
  }
  if (method_ == "GET") {
    return answer({{"rap-task",
                    "T_ROB1",
                    {{"name", "T_ROB1"},
                     {"type", "normal"},
                     {"taskstate", "linked"},
                     {"excstate", s_.task.running() ? "started" : "ready"},
                     {"active", "On"},
                     {"motiontask", "TRUE"}}}});
  }
  return task_action(query("action"));
}

HttpReply RwsHandler::task_action(const std::string& action) {
  if (action == "activate" || action == "deactivate") return no_content();
  if (action == "loadmod") return load_module();
  if (action == "unloadmod") {
    if (!holds("rapid")) return fault(403, kRwsNoMastership, "Mastership of rapid is needed");
    const std::string module = rapid::lower(form("module"));
    if (!s_.memory.module(module))
      return fault(400, kRwsUnknownModule, "Module " + form("module") + " is not loaded");
    if (s_.task.uses(module))
      return fault(403, kRwsHeldByOther, "Program pointer stands in module " + form("module"));
    s_.memory.unload(module);
    return no_content();
  }
  if (action == "set-pp-routine") {
    if (!holds("rapid")) return fault(403, kRwsNoMastership, "Mastership of rapid is needed");
    if (s_.executing()) return fault(403, kRwsHeldByOther, "Program is executing");
    if (!s_.task.set_pointer(rapid::lower(form("module")), rapid::lower(form("routine")))) {
      return fault(400, kRwsUnknownModule,
                   "Routine " + form("module") + "/" + form("routine") + " not found");
    }
    s_.path.reset(s_.reference);
    s_.egm_interrupted = false;
    return no_content();
  }
  return fault(400, kRwsBadValue, "Invalid action '" + action + "'");
}

HttpReply RwsHandler::load_module() {
  if (!holds("rapid")) {
    return s_.mastership.contains("rapid")
               ? fault(403, kRwsHeldByOther, "Requested resource is held by someone else")
               : fault(403, kRwsNoMastership, "Mastership of rapid is needed");
  }
  std::string path = rapid::lower(form("modulepath"));
  if (path.rfind("$home", 0) == 0) path = path.substr(5);
  while (!path.empty() && path[0] == '/') path.erase(0, 1);
  const auto file = s_.files.find(path);
  if (file == s_.files.end())
    return fault(400, kRwsBadModulePath, "Module path wrong: " + form("modulepath"));
  const bool replace = rapid::lower(form("replace")) == "true";
  // The name decides whether the running program would lose its ground.
  const auto parsed = rapid::parse_module(file->second, s_.memory.types());
  if (parsed) {
    const std::string& name = (*parsed)->name;
    if (s_.task.uses(name)) {
      if (s_.task.running()) return fault(403, kRwsHeldByOther, "Module " + name + " is executing");
      s_.task.clear_pointer();
    }
  }
  auto loaded = s_.memory.load(file->second, replace);
  if (!loaded) {
    const Error& error = loaded.error();
    s_.log(3, 40025, "Module could not be loaded", form("modulepath") + ": " + error.text());
    return fault(400, error.code == "rapid.exists" ? kRwsHeldByOther : kRwsBadModule,
                 "Load of " + form("modulepath") + " failed: " + error.text());
  }
  s_.log(1, 10054, "Module loaded", *loaded);
  return no_content();
}

HttpReply RwsHandler::modules() {
  if (method_ != "GET") return fault(400, kRwsBadValue, "Invalid action");
  if (const std::string task = query("task"); !task.empty() && rapid::lower(task) != "t_rob1") {
    return fault(404, kRwsBadValue, "Task " + task + " does not exist");
  }
  if (const std::string name = segment(3); !name.empty()) {
    const auto module = s_.memory.module(rapid::lower(name));
    if (!module) return fault(404, kRwsUnknownModule, "Module " + name + " is not loaded");
    if (query("resource") == "module-text") {
      return answer(
          {{"rap-module-text",
            name,
            {{"module-text", module->text}, {"module-length", std::to_string(module->text.size())}}}});
    }
    return answer({{"rap-module-info",
                    name,
                    {{"name", module->display}, {"type", module->system ? "SysMod" : "ProgMod"}}}});
  }
  Items items;
  for (const auto& [name, module] : s_.memory.modules()) {
    items.push_back({"rap-module-info-li",
                     module->display,
                     {{"name", module->display}, {"type", module->system ? "SysMod" : "ProgMod"}}});
  }
  return answer(items);
}

HttpReply RwsHandler::symbol_data() {
  // /rw/rapid/symbol/data/RAPID/{task}/{module}/{symbol}
  const std::string module = segments_.size() > 7 ? rapid::lower(segment(6)) : "";
  const std::string name = rapid::lower(segment(segments_.size() > 7 ? 7 : 6));
  if (rapid::lower(segment(5)) != "t_rob1")
    return fault(404, kRwsBadValue, "Task " + segment(5) + " does not exist");
  rapid::Datum* datum = s_.memory.symbol(module, name);
  if (!datum) return fault(404, kRwsNoResource, "Symbol " + path_ + " not found");
  if (method_ == "GET")
    return answer({{"rap-data",
                    path_.substr(std::min<std::size_t>(path_.size(), 22)),
                    {{"value", rapid::print(datum->value)}}}});
  if (!action_is("set")) return fault(400, kRwsBadValue, "Invalid action");
  if (!holds("rapid")) {
    return s_.mastership.contains("rapid")
               ? fault(403, kRwsHeldByOther, "Requested resource is held by someone else")
               : fault(403, kRwsNoMastership, "Mastership of rapid is needed");
  }
  if (datum->storage == rapid::Storage::Constant)
    return fault(403, kRwsRejected, datum->display + " is a constant");
  auto value = rapid::parse_literal(form("value"));
  if (!value) return fault(400, kRwsBadValue, value.error().text());
  if (Status fits = s_.memory.types().fit(*value, datum->type, datum->dimensions); !fits) {
    return fault(400, kRwsBadValue, fits.error().text());
  }
  datum->value = std::move(*value);
  return no_content();
}

HttpReply RwsHandler::symbol_properties() {
  const std::string name = rapid::lower(segment(segments_.size() > 7 ? 7 : 6));
  const rapid::Datum* datum = s_.memory.symbol(segments_.size() > 7 ? rapid::lower(segment(6)) : "", name);
  if (!datum) return fault(404, kRwsNoResource, "Symbol " + path_ + " not found");
  const bool persistent = datum->storage == rapid::Storage::Persistent;
  const std::string kind = persistent ? "per" : datum->storage == rapid::Storage::Constant ? "con" : "var";
  return answer({{"rap-symprop" + kind,
                  datum->display,
                  {{"symburl", "RAPID/T_ROB1/" + datum->module + "/" + datum->display},
                   {"symtyp", kind},
                   {"named", "true"},
                   {"dattyp", datum->type},
                   {"ndim", std::to_string(datum->dimensions.size())},
                   {"local", datum->local ? "true" : "false"},
                   {"rdonly", datum->storage == rapid::Storage::Constant ? "true" : "false"}}}});
}

HttpReply RwsHandler::mastership() {
  const std::string domain = segment(2);
  const std::vector<std::string> all{"cfg", "motion", "rapid"};
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
