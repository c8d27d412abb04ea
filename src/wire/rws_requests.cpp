#include "weldcell/wire/rws_requests.hpp"

namespace weldcell::wire {

namespace {

constexpr const char* kFormOne = "application/x-www-form-urlencoded";
constexpr const char* kFormTwo = "application/x-www-form-urlencoded;v=2.0";
constexpr const char* kHal = "application/hal+json;v=2.0";
constexpr const char* kHalSorted = "application/hal+json;v=2.1";
constexpr const char* kXhtml = "application/xhtml+xml;v=2.0";

std::string task_path(std::string_view task) { return "/rw/rapid/tasks/" + form_value(task); }
std::string file_path(std::string_view path) { return "/fileservice/" + form_value(path); }

}  // namespace

const char* to_string(RwsGeneration generation) {
  return generation == RwsGeneration::Two ? "RWS 2.0" : "RWS 1.0";
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

std::string form_value(std::string_view text) {
  constexpr std::string_view kPlain = "-_.~$/:,[]()*!'";
  constexpr const char* kHex = "0123456789ABCDEF";
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const bool alphanumeric = (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
    if (alphanumeric || kPlain.find(c) != std::string_view::npos) {
      out += c;
    } else {
      out += '%';
      out += kHex[byte >> 4];
      out += kHex[byte & 15];
    }
  }
  return out;
}

RwsAsk RwsDialect::get(std::string path) const {
  if (two()) return {"GET", std::move(path), "", "", hal_ ? kHal : kXhtml};
  path += path.find('?') == std::string::npos ? "?json=1" : "&json=1";
  return {"GET", std::move(path), "", "", ""};
}

RwsAsk RwsDialect::post(std::string path, std::string body) const {
  // Answers to a POST exist as XHTML only; the type stands even with an empty body, else 415.
  if (two()) return {"POST", std::move(path), std::move(body), kFormTwo, kXhtml};
  return {"POST", std::move(path), std::move(body), kFormOne, ""};
}

RwsAsk RwsDialect::act(const std::string& path, const char* verb, std::string body) const {
  return post(path + (two() ? "/" : "?action=") + verb, std::move(body));
}

RwsAsk RwsDialect::system() const { return get("/rw/system"); }

RwsAsk RwsDialect::controller_state() const {
  return get(two() ? "/rw/panel/ctrl-state" : "/rw/panel/ctrlstate");
}

RwsAsk RwsDialect::set_motors(bool on) const {
  const std::string body = on ? "ctrl-state=motoron" : "ctrl-state=motoroff";
  return two() ? post("/rw/panel/ctrl-state", body) : act("/rw/panel/ctrlstate", "setctrlstate", body);
}

RwsAsk RwsDialect::operation_mode() const { return get("/rw/panel/opmode"); }
RwsAsk RwsDialect::speed_ratio() const { return get("/rw/panel/speedratio"); }

RwsAsk RwsDialect::set_speed_ratio(int percent) const {
  // One of the few actions that generation 2 kept in the query.
  return post("/rw/panel/speedratio?action=setspeedratio", "speed-ratio=" + std::to_string(percent));
}

RwsAsk RwsDialect::execution() const { return get("/rw/rapid/execution"); }

RwsAsk RwsDialect::start(bool forever) const {
  return act("/rw/rapid/execution", "start",
             std::string("regain=continue&execmode=continue&cycle=") + (forever ? "forever" : "once") +
                 "&condition=none&stopatbp=disabled&alltaskbytsp=false");
}

RwsAsk RwsDialect::stop() const {
  return act("/rw/rapid/execution", "stop", two() ? "stopmode=stop&usetsp=normal" : "stopmode=stop");
}

RwsAsk RwsDialect::reset_pp() const { return act("/rw/rapid/execution", "resetpp"); }
RwsAsk RwsDialect::tasks() const { return get("/rw/rapid/tasks"); }
RwsAsk RwsDialect::program_pointer(std::string_view task) const { return get(task_path(task) + "/pcp"); }

RwsAsk RwsDialect::set_pp_to_routine(std::string_view task, std::string_view module,
                                     std::string_view routine) const {
  const std::string m = "module=" + form_value(module), r = "routine=" + form_value(routine);
  return two() ? act(task_path(task) + "/pcp", "routine", r + "&" + m + "&userlevel=FALSE")
               : act(task_path(task) + "/pcp", "set-pp-routine", m + "&" + r);
}

const char* RwsDialect::domain(MastershipDomain domain) const {
  if (two() && domain != MastershipDomain::Motion) return "edit";
  return to_string(domain);
}

RwsAsk RwsDialect::mastership(MastershipDomain of) const {
  return get(std::string("/rw/mastership/") + domain(of));
}
RwsAsk RwsDialect::request_mastership(MastershipDomain of) const {
  return act(std::string("/rw/mastership/") + domain(of), "request");
}
RwsAsk RwsDialect::release_mastership(MastershipDomain of) const {
  return act(std::string("/rw/mastership/") + domain(of), "release");
}

RwsAsk RwsDialect::read_file(std::string_view path) const {
  // Files come as they are, whatever is asked for.
  return {"GET", file_path(path), "", "", two() ? kXhtml : ""};
}

RwsAsk RwsDialect::write_file(std::string_view path, std::string_view bytes) const {
  return {"PUT", file_path(path), std::string(bytes), two() ? "text/plain;v=2.0" : "text/plain",
          two() ? kXhtml : ""};
}

RwsAsk RwsDialect::delete_file(std::string_view path) const {
  return {"DELETE", file_path(path), "", two() ? kFormTwo : "", two() ? kXhtml : ""};
}

RwsAsk RwsDialect::make_folder(std::string_view parent, std::string_view name) const {
  const std::string named = "fs-newname=" + form_value(name);
  return two() ? act(file_path(parent), "create", named)
               : post(file_path(parent), "fs-action=create&" + named);
}

RwsAsk RwsDialect::modules(std::string_view task) const {
  return get(two() ? task_path(task) + "/modules" : "/rw/rapid/modules?task=" + form_value(task));
}

RwsAsk RwsDialect::module_text(std::string_view task, std::string_view module) const {
  return get(two() ? task_path(task) + "/modules/" + form_value(module) + "/text"
                   : "/rw/rapid/modules/" + form_value(module) +
                         "?resource=module-text&task=" + form_value(task));
}

RwsAsk RwsDialect::load_module(std::string_view task, std::string_view path, bool replace) const {
  return act(task_path(task), "loadmod",
             "modulepath=" + form_value(path) + "&replace=" + (replace ? "true" : "false"));
}

RwsAsk RwsDialect::unload_module(std::string_view task, std::string_view module) const {
  return act(task_path(task), "unloadmod", "module=" + form_value(module));
}

std::string RwsDialect::symbol_path(std::string_view task, std::string_view module,
                                    std::string_view symbol) const {
  const std::string name = "RAPID/" + form_value(task) + "/" + form_value(module) + "/" + form_value(symbol);
  return two() ? "/rw/rapid/symbol/" + name + "/data" : "/rw/rapid/symbol/data/" + name;
}

RwsAsk RwsDialect::read_symbol(std::string_view task, std::string_view module,
                               std::string_view symbol) const {
  return get(symbol_path(task, module, symbol));
}

RwsAsk RwsDialect::write_symbol(std::string_view task, std::string_view module, std::string_view symbol,
                                std::string_view literal) const {
  const std::string path = symbol_path(task, module, symbol), body = "value=" + form_value(literal);
  return two() ? post(path, body) : act(path, "set", body);
}

RwsAsk RwsDialect::search_symbols(std::string_view task, std::string_view module,
                                  std::string_view pattern) const {
  std::string block = "RAPID/" + form_value(task);
  if (!module.empty()) block += "/" + form_value(module);
  return act("/rw/rapid/symbols", two() ? "search" : "search-symbols",
             "view=block&blockurl=" + block +
                 "&symtyp=any&vartyp=any&recursive=TRUE&skipshared=FALSE&onlyused=FALSE&regexp=" +
                 form_value(pattern));
}

RwsAsk RwsDialect::signals(std::string_view next) const {
  if (next.empty()) return get(two() ? "/rw/iosystem/signals?start=0&limit=100" : "/rw/iosystem/signals");
  // A page names the next one relative to its base, /rw/iosystem/.
  return get(next.front() == '/' ? std::string(next) : "/rw/iosystem/" + std::string(next));
}

RwsAsk RwsDialect::read_signal(std::string_view signal) const {
  return get("/rw/iosystem/signals/" + form_value(signal));
}

RwsAsk RwsDialect::write_signal(std::string_view signal, std::string_view value) const {
  return act("/rw/iosystem/signals/" + form_value(signal), two() ? "set-value" : "set",
             "lvalue=" + form_value(value));
}

RwsAsk RwsDialect::joints(std::string_view mechanical_unit) const {
  return get("/rw/motionsystem/mechunits/" + form_value(mechanical_unit) + "/jointtarget");
}

RwsAsk RwsDialect::event_log(int count) const {
  if (!two()) return get("/rw/elog/0?lang=en");
  RwsAsk ask = get("/rw/elog/0?lang=en&order=lifo&limit=" + std::to_string(count));
  if (hal_) ask.accept = kHalSorted;
  return ask;
}

RwsAsk RwsDialect::event(std::uint32_t number) const {
  return get("/rw/elog/0/" + std::to_string(number) + "?lang=en");
}

RwsAsk RwsDialect::logout() const { return {"GET", "/logout", "", "", two() ? kXhtml : ""}; }

RwsAsk RwsDialect::subscribe(const std::vector<RwsResource>& resources) const {
  std::string body;
  for (std::size_t i = 0; i < resources.size(); ++i) {
    const std::string n = std::to_string(i + 1);
    std::string uri;
    // The semicolon is literal, as the controllers' own examples have it.
    for (const char c : resources[i].uri) uri += c == ';' ? ";" : form_value(std::string_view(&c, 1));
    body += (i == 0 ? "resources=" : "&resources=") + n + "&" + n + "=" + uri + "&" + n +
            "-p=" + std::to_string(static_cast<int>(resources[i].priority));
  }
  return post("/subscription", body);
}

RwsAsk RwsDialect::unsubscribe(std::string_view group) const {
  return {"DELETE", "/subscription/" + form_value(group), "", two() ? kFormTwo : "", two() ? kXhtml : ""};
}

const char* RwsDialect::websocket_protocol() const {
  return two() ? "rws_subscription" : "robapi2_subscription";
}

RwsResource RwsDialect::controller_state_resource() const {
  return {two() ? "/rw/panel/ctrl-state;ctrlstate" : "/rw/panel/ctrlstate;ctrlstate", RwsPriority::Medium};
}
RwsResource RwsDialect::operation_mode_resource() const {
  return {"/rw/panel/opmode;opmode", RwsPriority::Medium};
}
RwsResource RwsDialect::execution_resource() const {
  return {"/rw/rapid/execution;ctrlexecstate", RwsPriority::Medium};
}
RwsResource RwsDialect::event_log_resource() const { return {"/rw/elog/0", RwsPriority::Medium}; }
RwsResource RwsDialect::signal_resource(std::string_view signal) const {
  return {"/rw/iosystem/signals/" + std::string(signal) + ";state", RwsPriority::High};
}
RwsResource RwsDialect::symbol_resource(std::string_view task, std::string_view module,
                                        std::string_view symbol) const {
  return {symbol_path(task, module, symbol) + ";value", RwsPriority::High};
}

std::string RwsDialect::module_path(std::string_view module) const {
  return two() ? "HOME/" + std::string(module) + ".modx" : "$home/" + std::string(module) + ".mod";
}

}  // namespace weldcell::wire
