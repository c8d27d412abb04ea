// Generation 2 in the paths of generation 1: where the verb stands, what moved, and what is no longer there.
#include <algorithm>

#include "sim/controller_state.hpp"
#include "sim/rws_handler.hpp"

namespace weldcell::sim {

using ports::HttpReply;

namespace {

bool versioned(const std::string& type) { return type.find(";v=2.") != std::string::npos; }

bool among(const std::string& word, std::initializer_list<const char*> words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

}  // namespace

std::optional<HttpReply> RwsHandler::refused_type(const ports::HttpRequest& request) const {
  if (segment(0) == "logout" || segment(0) == "poll") return std::nullopt;
  HttpReply refused;
  if (method_ != "GET" && !versioned(request.content_type)) {
    refused.status = 415;
    return refused;
  }
  const bool raw = segment(0) == "fileservice";
  const bool hal = accept_.find("hal+json") != std::string::npos;
  if (!raw && (!versioned(accept_) || (hal && !s_.truth.rws_hal) || (hal && method_ == "POST"))) {
    refused.status = 406;
    return refused;
  }
  return std::nullopt;
}

bool RwsHandler::rapid_from_path() {
  const auto take_action = [this](const std::string& verb) {
    action_ = verb;
    segments_.pop_back();
    return method_ == "POST";
  };
  const std::string what = segment(2), last = segments_.back();
  const std::size_t size = segments_.size();
  if (what == "execution" && size == 4) {
    if (!among(last, {"start", "stop", "resetpp", "cycle"})) return false;
    return take_action(last == "cycle" ? "setcycle" : last);
  }
  if (what == "tasks") {
    if (size == 4 && among(last, {"activate", "deactivate"})) {
      segments_[3] = form("task");
      action_ = last;
      return method_ == "POST";
    }
    if (size == 5 && among(last, {"loadmod", "unloadmod", "activate", "deactivate"}))
      return take_action(last);
    if (size == 6 && segment(4) == "pcp")
      return (last == "routine" && take_action("set-pp-routine")) ||
             (last == "reset" && take_action("resetpp"));
    if (size >= 5 && segment(4) == "modules" && method_ == "GET") {
      query_["task"] = segment(3);
      if (size == 7 && last == "text") query_["resource"] = "module-text";
      const std::string module = segment(5);
      segments_ = {"rw", "rapid", "modules"};
      if (!module.empty()) segments_.push_back(module);
      return true;
    }
    return method_ == "GET" || size != 4;
  }
  if (what == "symbol") {
    if (segment(3) != "RAPID" || !among(last, {"data", "properties"})) return false;
    segments_.pop_back();
    segments_.insert(segments_.begin() + 3, last);
    if (method_ == "POST") action_ = "set";
    return true;
  }
  if (what == "symbols") return last == "search" && take_action("search-symbols");
  return what != "modules";
}

bool RwsHandler::action_from_path() {
  if (segments_.empty()) return false;
  const std::string a = segment(0), b = segment(1), last = segments_.back();
  const auto take_action = [this](const std::string& verb) {
    action_ = verb;
    segments_.pop_back();
    return method_ == "POST";
  };
  if (a == "fileservice") {
    if (method_ == "POST") return among(last, {"create", "copy", "rename"}) && take_action(last);
    return true;
  }
  if (a == "users") return method_ != "POST" || (last == "register" ? take_action("") : b == "rmmp");
  if (a == "rw" && b == "cfg" && method_ == "POST") return last == "load" && take_action(last);
  if (a != "rw") return true;
  if (b == "panel") {
    if (segment(2) == "ctrlstate") return false;
    if (segment(2) == "ctrl-state") segments_[2] = "ctrlstate";
    if (method_ != "POST") return true;
    action_ = segment(2) == "ctrlstate" ? "setctrlstate"
              : segment(2) == "opmode"  ? "setopmode"
                                        : query("action");
    return true;
  }
  if (b == "rapid") return rapid_from_path();
  if (b == "mastership" && method_ == "POST")
    return among(last, {"request", "release", "request-with-id", "release-with-id"}) && take_action(last);
  if (b == "iosystem") {
    if (method_ == "POST" && !(last == "set-value" && take_action("set"))) return false;
    return segments_.size() == 3 || segments_.size() == 6;
  }
  return true;
}

}  // namespace weldcell::sim
