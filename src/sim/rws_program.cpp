// Execution, tasks, modules and symbols over RWS.
#include <algorithm>
#include <regex>

#include "sim/controller_state.hpp"
#include "sim/rws_handler.hpp"

namespace weldcell::sim {

using ports::HttpReply;

HttpReply RwsHandler::execution() {
  if (method_ == "GET") {
    return answer({{"rap-execution",
                    "execution",
                    {{"ctrlexecstate", s_.executing() ? "running" : "stopped"},
                     {"cycle", s_.task.forever() ? "forever" : "once"}}}});
  }
  if (action_is("start")) return start();
  if (action_is("stop")) {
    const std::string how = form("stopmode");
    if (how != "cycle" && how != "instr" && how != "stop" && how != "qstop")
      return fault(400, kRwsBadValue, "Invalid stopmode '" + how + "'");
    s_.stop_program("stopped by RWS");
    return no_content();
  }
  if (action_is("resetpp")) {
    if (two()) {
      if (const auto refused = no_edit_right()) return *refused;
    }
    if (s_.executing()) return fault(403, kRwsHeldByOther, "Program is executing");
    if (!s_.task.set_pointer("", "main")) return fault(400, kRwsWrongState, "No routine main");
    s_.path.reset(s_.reference);
    s_.egm_interrupted = false;
    s_.log(1, 10002, "Program pointer has been reset", "The program pointer of task T_ROB1 has been reset");
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
  const bool manual_granted = s_.rmmp.granted() && s_.rmmp.session == session_ && s_.rmmp.privilege == "exec";
  if (!s_.truth.auto_mode && !manual_granted) return fault(403, kRwsRejected, "Remote start needs AUTO");
  if (!s_.truth.remote_start)
    return fault(403, kRwsNotAllowed, "User lacks the grant Remote start and stop in auto");
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
    return task_action(action_);
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
  return task_action(action_);
}

HttpReply RwsHandler::task_action(const std::string& action) {
  if (action == "activate" || action == "deactivate") return no_content();
  if (action == "loadmod") return load_module();
  if (action == "unloadmod") {
    if (const auto refused = no_edit_right()) return *refused;
    const std::string module = rapid::lower(form("module"));
    if (!s_.memory.module(module))
      return fault(400, kRwsUnknownModule, "Module " + form("module") + " is not loaded");
    if (s_.task.uses(module))
      return fault(403, kRwsHeldByOther, "Program pointer stands in module " + form("module"));
    s_.memory.unload(module);
    return no_content();
  }
  if (action == "resetpp") {
    if (const auto refused = no_edit_right()) return *refused;
    if (!s_.task.set_pointer("", "main")) return fault(400, kRwsWrongState, "No routine main");
    return no_content();
  }
  if (action == "set-pp-routine") {
    if (const auto refused = no_edit_right()) return *refused;
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
  if (const auto refused = no_edit_right()) return *refused;
  std::string path = rapid::lower(form("modulepath"));
  if (two() && !path.ends_with(".modx") && !path.ends_with(".sysx"))
    return fault(400, kRwsBadModule, "RobotWare 7 loads .modx and .sysx: " + form("modulepath"));
  if (path.rfind("$home", 0) == 0) path = path.substr(5);
  if (two() && path.rfind("home/", 0) == 0) path = path.substr(5);
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
                    "RAPID/T_ROB1/" + datum->module + "/" + datum->display,
                    {{"value", rapid::print(datum->value)}}}});
  if (!action_is("set")) return fault(400, kRwsBadValue, "Invalid action");
  if (const auto refused = no_edit_right()) return *refused;
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

HttpReply RwsHandler::symbol_search() {
  if (!action_is("search-symbols")) return fault(400, kRwsBadValue, "Invalid action");
  const std::string block = form("blockurl");
  const std::string prefix = "RAPID/T_ROB1";
  if (rapid::lower(block).rfind(rapid::lower(prefix), 0) != 0)
    return fault(400, kRwsBadValue, "Invalid blockurl '" + block + "'");
  const std::string module =
      block.size() > prefix.size() + 1 ? rapid::lower(block.substr(prefix.size() + 1)) : "";
  std::regex pattern;
  try {
    const std::string text = form("regexp");
    pattern = std::regex(text.empty() ? ".*" : text.substr(0, 200), std::regex::icase | std::regex::extended);
  } catch (const std::regex_error&) {
    return fault(400, kRwsBadValue, "Invalid regexp");
  }
  Items items;
  for (const auto& [name, datum] : s_.memory.data_of(module)) {
    if (!std::regex_search(datum->display, pattern)) continue;
    items.push_back(
        {datum->storage == rapid::Storage::Persistent ? "rap-sympropper-li" : "rap-sympropvar-li",
         datum->display,
         {{"symburl", prefix + "/" + s_.memory.module(datum->module)->display + "/" + datum->display},
          {"name", datum->display},
          {"dattyp", datum->type},
          {"ndim", std::to_string(datum->dimensions.size())}}});
  }
  return answer(items);
}

}  // namespace weldcell::sim
