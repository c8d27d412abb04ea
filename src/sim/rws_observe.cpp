#include "sim/rws_observe.hpp"

#include <fmt/format.h>

#include "sim/controller_state.hpp"

namespace weldcell::sim {

namespace {

using Observed = std::optional<RwsObserved>;

bool after(std::string_view& text, std::string_view prefix) {
  if (text.substr(0, prefix.size()) != prefix) return false;
  text.remove_prefix(prefix.size());
  return true;
}

Observed symbol(ControllerState& s, std::string_view name, const std::string& uri) {
  const std::size_t task = name.find('/'), module = name.find('/', task + 1);
  if (module == std::string_view::npos || rapid::lower(std::string(name.substr(0, task))) != "t_rob1")
    return std::nullopt;
  const std::string owner(name.substr(task + 1, module - task - 1)), own(name.substr(module + 1));
  const rapid::Datum* datum = s.memory.symbol(rapid::lower(owner), rapid::lower(own));
  if (datum == nullptr || datum->storage != rapid::Storage::Persistent) return std::nullopt;
  return RwsObserved{
      "rap-value-ev", "RAPID/" + std::string(name), uri, {{"value", rapid::print(datum->value)}}, true};
}

Observed signal(ControllerState& s, std::string_view place, const std::string& uri) {
  const std::string wanted = rapid::lower(std::string(place.substr(place.rfind('/') + 1)));
  for (const auto& [name, value] : s.signals()) {
    if (rapid::lower(name) != wanted) continue;
    return RwsObserved{"ios-signalstate-ev",
                       std::string(place),
                       uri,
                       {{"lvalue", fmt::format("{:g}", value)}, {"lstate", "not simulated"}},
                       true};
  }
  return std::nullopt;
}

}  // namespace

std::optional<RwsObserved> rws_observed(ControllerState& s, const std::string& uri) {
  const std::size_t mark = uri.find(';');
  std::string_view path = std::string_view(uri).substr(0, mark);
  const std::string suffix = mark == std::string::npos ? "" : uri.substr(mark + 1);
  const bool two = s.generation == 2;
  if (path == (two ? "/rw/panel/ctrl-state" : "/rw/panel/ctrlstate") &&
      (suffix == "ctrlstate" || (!two && suffix.empty())))
    return RwsObserved{"pnl-ctrlstate-ev", "ctrlstate", uri, {{"ctrlstate", to_string(s.panel)}}};
  if (path == "/rw/panel/opmode" && (suffix == "opmode" || (!two && suffix.empty())))
    return RwsObserved{"pnl-opmode-ev", "opmode", uri, {{"opmode", s.operation_mode()}}};
  if (path == "/rw/panel/speedratio" && (suffix == "speedratio" || (!two && suffix.empty())))
    return RwsObserved{"pnl-speedratio-ev",
                       "speedratio",
                       uri,
                       {{"speedratio", std::to_string(static_cast<int>(s.speed_ratio * 100 + 0.5))}}};
  if (path == "/rw/rapid/execution" && suffix == "ctrlexecstate")
    return RwsObserved{"rap-ctrlexecstate-ev",
                       "ctrlexecstate",
                       uri,
                       {{"ctrlexecstate", s.executing() ? "running" : "stopped"}}};
  if (path == "/rw/rapid/execution" && suffix == "rapidexeccycle")
    return RwsObserved{"rap-execcycle-ev",
                       "rapidexeccycle",
                       uri,
                       {{"rapidexeccycle", s.task.forever() ? "forever" : "once"}}};
  if (path == "/rw/elog/0" && suffix.empty()) {
    const std::string number = std::to_string(s.event_number);
    return RwsObserved{
        "elog-message-ev", "/rw/elog/0/" + number, "/rw/elog/0/" + number, {{"seqnum", number}}};
  }
  if (path == "/rw/mastership" && suffix.empty()) {
    RwsObserved out{"msh-resource-value", "mastership", uri, {}};
    for (const char* domain : two ? std::vector{"edit", "motion"} : std::vector{"cfg", "motion", "rapid"})
      out.fields.emplace_back(domain, s.mastership.contains(domain) ? "remote" : "nomaster");
    return out;
  }
  if (path == "/rw/rapid/uiinstr" && suffix == "uievent")
    return RwsObserved{"rap-ui-ev", "uiinstr", uri, {{"instr", ""}}};
  if (path == "/rw/rapid/tasks/T_ROB1" && suffix == "taskchange")
    return RwsObserved{"rap-task-ev",
                       "T_ROB1",
                       uri,
                       {{"excstate", s.task.running() ? "started" : "ready"},
                        {"taskstate", s.task.has_pointer() ? "linked" : "loaded"}}};
  if (path == "/rw/rapid/tasks/T_ROB1/pcp" && suffix == "motionpointerchange") {
    const auto at = s.task.position();
    return RwsObserved{
        "rap-mp-ev",
        "motionpointer",
        uri,
        {{"modulename", at.module}, {"routinename", at.routine}, {"line", std::to_string(at.line)}}};
  }
  if (after(path, "/rw/iosystem/signals/") && suffix == "state") return signal(s, path, uri);
  if (suffix != "value") return std::nullopt;
  if (!two && after(path, "/rw/rapid/symbol/data/RAPID/")) return symbol(s, path, uri);
  if (two && after(path, "/rw/rapid/symbol/RAPID/") && path.ends_with("/data"))
    return symbol(s, path.substr(0, path.size() - 5), uri);
  return std::nullopt;
}

}  // namespace weldcell::sim
