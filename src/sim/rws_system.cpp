// What a controller says of itself: version and options, clock, error codes, configuration rows.
#include <fmt/format.h>

#include <cstdio>
#include <ctime>

#include "sim/controller_state.hpp"
#include "sim/rws_handler.hpp"

namespace weldcell::sim {

using ports::HttpReply;

namespace {
constexpr std::time_t kCalendarBegin = 1767225600;  // the simulated controller's calendar begins with 2026
}

std::string calendar(HostTime at, double set_s) {
  const std::time_t t = kCalendarBegin + static_cast<std::time_t>(seconds(at.ns) + set_s);
  std::tm parts{};
  gmtime_r(&t, &parts);
  return fmt::format("{:04}-{:02}-{:02} T {:02}:{:02}:{:02}", parts.tm_year + 1900, parts.tm_mon + 1,
                     parts.tm_mday, parts.tm_hour, parts.tm_min, parts.tm_sec);
}

HttpReply RwsHandler::clock() {
  if (method_ == "GET") {
    const std::string now = calendar(s_.now, s_.calendar_set_s);
    return answer({{"ctrl-clock-info", "datetime", {{"datetime", now}}}});
  }
  const auto read = [this](const char* key, int low, int high, int& out) {
    const std::string text = form(key);
    return std::sscanf(text.c_str(), "%d", &out) == 1 && out >= low && out <= high;
  };
  std::tm parts{};
  if (method_ != "PUT" || !read("sys-clock-year", 1970, 2099, parts.tm_year) ||
      !read("sys-clock-month", 1, 12, parts.tm_mon) || !read("sys-clock-day", 1, 31, parts.tm_mday) ||
      !read("sys-clock-hour", 0, 23, parts.tm_hour) || !read("sys-clock-min", 0, 59, parts.tm_min) ||
      !read("sys-clock-sec", 0, 59, parts.tm_sec)) {
    return fault(400, kRwsBadValue, "Invalid clock");
  }
  parts.tm_year -= 1900;
  parts.tm_mon -= 1;
  s_.calendar_set_s = static_cast<double>(timegm(&parts) - kCalendarBegin) - seconds(s_.now.ns);
  return no_content();
}

HttpReply RwsHandler::configuration() {
  if (method_ == "POST") return load_configuration();
  // /rw/cfg/{topic}/{type}/instances[/{name}]
  const auto topic = s_.configuration.find(segment(2));
  const std::string type = segment(3), name = segment(5);
  if (topic == s_.configuration.end() || !topic->second.contains(type) || segment(4) != "instances")
    return fault(404, kRwsNoResource, "No configuration type " + path_);
  const auto item = [&](const ConfigurationRow& row, const char* kind) {
    Item out{kind, row.name(), {{"rdonly", "false"}, {"instanceid", row.name()}}, {}};
    for (const auto& [key, value] : row.attributes)
      out.parts.push_back({"cfg-ia-t", key, {{"value", value}}, {}});
    return out;
  };
  if (!name.empty()) {
    const ConfigurationRow* row = find_row(s_.configuration, topic->first, type, name);
    return row ? answer({item(*row, "cfg-dt-instance")}) : fault(404, kRwsNoResource, "No instance " + name);
  }
  Items items;
  for (const ConfigurationRow& row : topic->second.at(type)) items.push_back(item(row, "cfg-dt-instance-li"));
  return answer(items);
}

HttpReply RwsHandler::load_configuration() {
  const std::string how = form("action-type");
  if (!action_is("load") || (how != "add" && how != "replace" && how != "add-with-reset"))
    return fault(400, kRwsBadValue, "Invalid action or action-type");
  if (!holds(two() ? "edit" : "cfg")) return fault(403, kRwsNoMastership, "Mastership is needed");
  std::string path = rapid::lower(form("filepath"));
  for (const char* volume : {"$home/", "home/"}) {
    if (path.rfind(volume, 0) == 0) path = path.substr(std::string(volume).size());
  }
  const auto file = s_.files.find(path);
  if (file == s_.files.end()) return fault(404, kRwsNoPath, "Path does not exist: " + form("filepath"));
  const auto rows = parse_configuration(file->second);
  if (!rows.ok()) return fault(400, kRwsBadValue, rows.error().text());
  if (how == "add") {
    for (const auto& [topic, types] : *rows) {
      for (const auto& [type, list] : types) {
        for (const ConfigurationRow& row : list) {
          if (find_row(s_.configuration, topic, type, row.name()))
            return fault(400, kRwsBadValue, "Duplicate instance " + row.name());
        }
      }
    }
  }
  add_rows(s_.configuration, *rows);
  s_.log(2, 71245, "Configuration loaded", "a restart makes it valid");
  return no_content();
}

HttpReply RwsHandler::system() {
  if (method_ != "GET") return fault(400, kRwsBadValue, "Invalid action");
  const char* const sysid = "{5E5A0000-0000-4000-8000-000000002600}";
  Items items;
  if (two()) {
    items.push_back({"sys-system",
                     "system",
                     {{"major", "7"},
                      {"minor", "16"},
                      {"name", "SIM_2600"},
                      {"rwversion", "7.16.0+229"},
                      {"sysid", sysid},
                      {"starttm", calendar(s_.started_at, s_.calendar_set_s)}}});
  } else {
    items.push_back({"sys-system-li",
                     "system",
                     {{"name", "SIM_2600"},
                      {"rwversion", "6.10.0130"},
                      {"rwversionname", "6.10.01.00"},
                      {"sysid", sysid},
                      {"starttm", calendar(s_.started_at, s_.calendar_set_s)}}});
  }
  const char* const one[] = {"616-1 PC Interface", "689-1 Externally Guided Motion (EGM)", "633-4 Arc"};
  const char* const seven[] = {"RobotWare Base", "3124-1 Externally Guided Motion", "3117-1 Arc"};
  for (const char* option : two() ? seven : one) {
    items.push_back({two() ? "sys-option" : "sys-option-li", option, {{"option", option}}});
  }
  return answer(items);
}

HttpReply RwsHandler::retcode() {
  static const std::map<std::string, const char*> kCodes{
      {std::to_string(kRwsHeldByOther), "Requested resource is held by someone else"},
      {std::to_string(kRwsNoMastership), "Required mastership is missing"},
      {std::to_string(kRwsRejected), "The request was rejected"},
      {std::to_string(kRwsNotAllowed), "The user is not allowed to do this"},
      {std::to_string(kRwsBadValue), "Invalid parameter value"},
      {std::to_string(kRwsWrongState), "Execution start refused in this state"},
      {std::to_string(kRwsBadModule), "Module name invalid or module not loadable"},
      {std::to_string(kRwsUnknownModule), "Unknown module or symbol"},
      {std::to_string(kRwsNoResource), "Resource not found"},
      {std::to_string(kRwsBadSignal), "Invalid IO signal"},
      {std::to_string(kRwsNoPath), "Path does not exist"},
      {std::to_string(kRwsBadVolume), "Bad volume"},
      {std::to_string(kRwsBadModulePath), "Module path is wrong"}};
  const auto found = kCodes.find(query("code"));
  if (found == kCodes.end()) return fault(404, kRwsBadValue, "Unknown code");
  return answer({{"retcode-info",
                  query("code"),
                  {{"code", found->first}, {"description", found->second}, {"severity", "Error"}}}});
}

}  // namespace weldcell::sim
