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

std::string RwsHandler::query(const std::string& key) const {
  const auto found = query_.find(key);
  return found == query_.end() ? "" : found->second;
}
std::string RwsHandler::form(const std::string& key) const {
  const auto found = form_.find(key);
  return found == form_.end() ? "" : found->second;
}
std::string RwsHandler::segment(std::size_t i) const { return i < segments_.size() ? segments_[i] : ""; }
bool RwsHandler::two() const { return s_.generation == 2; }
bool RwsHandler::action_is(const std::string& wanted) const { return method_ == "POST" && action_ == wanted; }
bool RwsHandler::holds(const std::string& domain) const {
  const auto holder = s_.mastership.find(domain);
  return holder != s_.mastership.end() && holder->second == session_;
}

std::optional<HttpReply> RwsHandler::no_edit_right() const {
  if (holds(edit_domain())) return std::nullopt;
  if (s_.mastership.contains(edit_domain()))
    return fault(403, kRwsHeldByOther, "Requested resource is held by someone else");
  if (query("mastership") == "implicit") return std::nullopt;
  return fault(403, kRwsNoMastership, std::string("Mastership of ") + edit_domain() + " is needed");
}

bool RwsHandler::read_path(const std::string& path) {
  const std::size_t mark = path.find('?');
  path_ = url_decoded(path.substr(0, mark));
  query_ = parse_form(mark == std::string::npos ? "" : std::string_view(path).substr(mark + 1));
  std::size_t at = 0;
  while (at < path_.size()) {
    const std::size_t next = std::min(path_.find('/', at), path_.size());
    if (next > at) segments_.push_back(path_.substr(at, next - at));
    at = next + 1;
  }
  // The volumes' $ must stand as it is.
  return segment(0) != "fileservice" || path.find("%24") == std::string::npos;
}

HttpReply RwsHandler::handle(const ports::HttpRequest& request) {
  method_ = request.method;
  body_ = request.body;
  accept_ = request.accept;
  const bool readable = read_path(request.path);
  if (s_.fault_until_s.contains("rws_503")) {
    HttpReply busy;
    busy.status = 503;
    busy.body = "Service Unavailable";
    return busy;
  }
  if (!readable) return fault(400, kRwsBadVolume, "Bad volume in " + request.path);
  if (method_ != "PUT" || segment(0) == "ctrl") form_ = parse_form(body_);
  if (two()) {
    if (const auto refused = refused_type(request)) return *refused;
    if (!action_from_path()) return fault(404, kRwsNoResource, "Resource not found: " + path_);
  } else if (method_ == "POST") {
    action_ = query("action");
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
  if (a == "ctrl" && b == "clock") return clock();
  if (a == "rw" && b == "panel") return panel();
  if (a == "rw" && b == "rapid") {
    if (c == "execution") return execution();
    if (c == "tasks") return tasks();
    if (c == "modules") return modules();
    if (c == "symbol" && segment(3) == "data") return symbol_data();
    if (c == "symbol" && segment(3) == "properties") return symbol_properties();
    if (c == "symbols") return symbol_search();
  }
  if (a == "rw" && b == "mastership") return mastership();
  if (a == "users") return users();
  if (a == "rw" && b == "motionsystem" && c == "mechunits") return mechunits();
  if (a == "rw" && b == "iosystem") return signals();
  if (a == "rw" && b == "elog") return elog();
  if (a == "rw" && b == "system") return system();
  if (a == "rw" && b == "retcode") return retcode();
  if (a == "rw" && b == "cfg") return configuration();
  return fault(404, kRwsNoResource, "Resource not found: " + path_);
}

}  // namespace weldcell::sim
