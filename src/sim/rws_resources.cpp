// The resources of RWS that only show things, signals and files.
#include <fmt/format.h>
#include <algorithm>
#include <charconv>

#include "sim/controller_state.hpp"
#include "sim/rws_handler.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::sim {

using ports::HttpReply;

namespace {

std::string decimal(double value) { return fmt::format("{:.6g}", value); }
std::string precise(double value) { return fmt::format("{:.9g}", value); }
const char* const kUnused = "8.999999E+09";
constexpr std::size_t kMostOnAPage = 100;
/// Network and device of every simulated signal; generation 2 addresses them in full.
constexpr const char* kSignalPlace = "EtherNetIP/Local_IO/";

}  // namespace

HttpReply RwsHandler::mechunits() {
  if (method_ != "GET") return fault(400, kRwsBadValue, "Invalid action");
  const std::string unit = segment(3), what = segment(4);
  if (unit.empty()) {
    return answer({{"ms-mechunit-li",
                    "ROB_1",
                    {{"activation-allowed", "true"}, {"drive-module", "1"}, {"mode", "Activated"}}}});
  }
  if (rapid::lower(unit) != "rob_1") return fault(404, kRwsNoResource, "No mechanical unit " + unit);
  if (what.empty()) {
    return answer({{"ms-mechunit",
                    "ROB_1",
                    {{"name", "ROB_1"},
                     {"type", "TCPRobot"},
                     {"task", "T_ROB1"},
                     {"mode", "Activated"},
                     {"axes", "6"},
                     {"tool-name", "tool0"},
                     {"wobj-name", "wobj0"},
                     {"payload-name", "load0"},
                     {"total-payload-name", ""}}}});
  }
  if (what == "jointtarget") {
    Fields fields;
    int axis = 0;
    for (const double joint : s_.servo.posture())
      fields.emplace_back("rax_" + std::to_string(++axis), precise(deg(joint)));
    for (const char c : {'a', 'b', 'c', 'd', 'e', 'f'}) fields.emplace_back(std::string("eax_") + c, kUnused);
    return answer({{"ms-jointtarget", "jointtarget", fields}});
  }
  if (what == "robtarget" || what == "cartesian") return robtarget();
  return fault(404, kRwsNoResource, "Resource not found: " + path_);
}

HttpReply RwsHandler::robtarget() {
  const auto frame = [this](const std::string& name, const char* type) -> const rapid::Value* {
    const rapid::Datum* datum = s_.memory.find({}, rapid::lower(name));
    return datum && datum->type == type ? &datum->value : nullptr;
  };
  const auto iso = [](const rapid::Value& pose) {
    Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
    const auto &t = pose.items[0].items, &q = pose.items[1].items;
    out.translation() = Eigen::Vector3d(t[0].number, t[1].number, t[2].number);
    out.linear() = Eigen::Quaterniond(q[0].number, q[1].number, q[2].number, q[3].number)
                       .normalized()
                       .toRotationMatrix();
    return out;
  };
  Eigen::Isometry3d pose = kinematics::forward(s_.arm, s_.servo.posture()).iso;
  if (const std::string tool = query("tool"); !tool.empty()) {
    const rapid::Value* value = frame(tool, "tooldata");
    if (!value) return fault(400, kRwsBadValue, "No tool " + tool);
    pose = pose * iso(value->items[1]);
  }
  if (const std::string wobj = query("wobj"); !wobj.empty() && rapid::lower(query("coordinate")) == "wobj") {
    const rapid::Value* value = frame(wobj, "wobjdata");
    if (!value) return fault(400, kRwsBadValue, "No work object " + wobj);
    pose = (iso(value->items[3]) * iso(value->items[4])).inverse() * pose;
  }
  const Eigen::Quaterniond q(pose.linear());
  const auto c = kinematics::configuration(s_.arm, s_.servo.posture());
  Fields fields{{"x", precise(pose.translation().x())},
                {"y", precise(pose.translation().y())},
                {"z", precise(pose.translation().z())},
                {"q1", precise(q.w())},
                {"q2", precise(q.x())},
                {"q3", precise(q.y())},
                {"q4", precise(q.z())}};
  const bool cartesian = segment(4) == "cartesian";
  const std::string names[2][4] = {{"cf1", "cf4", "cf6", "cfx"}, {"j1", "j4", "j6", "jx"}};
  const int conf[4] = {c.cf1, c.cf4, c.cf6, c.cfx};
  for (std::size_t i = 0; i < 4; ++i) fields.emplace_back(names[cartesian][i], std::to_string(conf[i]));
  for (const char e : {'a', 'b', 'c', 'd', 'e', 'f'}) {
    // One client reads eaxa, another eax_a.
    if (!cartesian) fields.emplace_back(std::string("eax") + e, kUnused);
    if (!cartesian) fields.emplace_back(std::string("eax_") + e, kUnused);
  }
  return answer({{cartesian ? "ms-mechunit-cartesian" : "ms-robtargets", segment(4), fields}});
}

HttpReply RwsHandler::set_signal(const std::string& name) {
  if (!action_is("set")) return fault(400, kRwsBadValue, "Invalid action");
  double value = 0;
  const std::string text = form("lvalue");
  if (std::from_chars(text.data(), text.data() + text.size(), value).ec != std::errc{} ||
      (value != 0 && value != 1)) {
    return fault(400, kRwsBadValue, "Invalid lvalue");
  }
  if (rapid::lower(name).rfind("di", 0) == 0)
    return fault(403, kRwsRejected, "Signal " + name + " is an input: access level");
  s_.set_signal(name, value);
  return no_content();
}

HttpReply RwsHandler::signals() {
  const auto item = [this](const std::string& name, double value, const char* type) -> Item {
    return {type,
            two() ? std::string(kSignalPlace) + name : name,
            {{"name", name},
             {"type", rapid::lower(name).rfind("di", 0) == 0 ? "DI" : "DO"},
             {"category", ""},
             {"lvalue", decimal(value)},
             {"lstate", "not simulated"}}};
  };
  if (segment(2) != "signals") return fault(404, kRwsNoResource, "Resource not found: " + path_);
  const auto all = s_.signals();
  if (segments_.size() == 3) {
    const auto number = [this](const char* key, std::size_t otherwise) {
      const std::string text = query(key);
      std::from_chars(text.data(), text.data() + text.size(), otherwise);
      return otherwise;
    };
    const std::size_t start = std::min(number("start", 0), all.size());
    std::size_t limit = number("limit", two() ? kMostOnAPage : all.size());
    if (two()) limit = std::clamp<std::size_t>(limit, 1, kMostOnAPage);
    const std::size_t end = start + std::min(limit, all.size() - start);
    Items items;
    for (std::size_t i = start; i < end; ++i)
      items.push_back(item(all[i].first, all[i].second, "ios-signal-li"));
    const bool more = two() && end < all.size();
    return answer(items, more ? fmt::format("signals?start={}&limit={}", end, limit) : "");
  }
  const std::string name = segments_.back();
  for (const auto& [signal, value] : all) {
    if (rapid::lower(signal) != rapid::lower(name)) continue;
    return method_ == "GET" ? answer({item(signal, value, "ios-signal")}) : set_signal(signal);
  }
  return fault(404, kRwsBadSignal, "No signal " + name);
}

HttpReply RwsHandler::make_folder(const std::string& parent) {
  const std::string name = rapid::lower(form("fs-newname"));
  if ((!two() && form("fs-action") != "create") || name.empty() || name.find('/') != std::string::npos)
    return fault(400, kRwsBadValue, "Invalid fs-action or fs-newname");
  s_.folders.insert((parent.empty() ? "" : parent + "/") + name);
  HttpReply reply;
  reply.status = 201;
  reply.headers["Location"] = path_ + "/" + name;
  return reply;
}

/// copy and rename: `path` is the file, lower case below the volume.
HttpReply RwsHandler::another_name(const std::string& path) {
  const auto file = s_.files.find(path);
  if (file == s_.files.end()) return fault(404, kRwsNoPath, "Path does not exist: " + path_);
  const std::string name = rapid::lower(form("fs-newname"));
  if (name.empty() || name.find('/') != std::string::npos)
    return fault(400, kRwsBadValue, "Invalid fs-newname");
  const std::size_t folder = path.rfind('/');
  const std::string fresh = (folder == std::string::npos ? "" : path.substr(0, folder + 1)) + name;
  std::string content = file->second;
  const bool copy = action_ == "copy";
  if (!copy) s_.files.erase(file);
  s_.files[fresh] = std::move(content);
  if (!copy) return no_content();
  HttpReply reply;
  reply.status = 201;
  reply.headers["Location"] = path_.substr(0, path_.rfind('/')) + "/" + name;
  return reply;
}

HttpReply RwsHandler::fileservice() {
  if (rapid::lower(segment(1)) != (two() ? "home" : "$home"))
    return fault(400, kRwsBadVolume, "Bad volume " + segment(1));
  std::string path, folder;
  for (std::size_t i = 2; i < segments_.size(); ++i) {
    if (i > 2) folder = path;
    path += (i > 2 ? "/" : "") + rapid::lower(segments_[i]);
  }
  if (!folder.empty() && !s_.folders.contains(folder))
    return fault(404, kRwsNoPath, "Path does not exist: " + path_);
  if (method_ == "POST" && (action_ == "copy" || action_ == "rename")) return another_name(path);
  if (method_ == "POST") return make_folder(path);
  if (method_ == "PUT") {
    if (path.empty()) return fault(400, kRwsNoPath, "File name missing");
    const bool fresh = !s_.files.contains(path);
    s_.files[path] = body_;
    HttpReply reply;
    reply.status = fresh ? 201 : 200;
    return reply;
  }
  if (method_ == "GET" && (path.empty() || s_.folders.contains(path))) {
    const std::string below = path.empty() ? "" : path + "/";
    Items items;
    const auto own = [&below](const std::string& full) {
      return full.rfind(below, 0) == 0 && full.find('/', below.size()) == std::string::npos;
    };
    for (const std::string& one : s_.folders) {
      if (own(one))
        items.push_back({"fs-dir", one.substr(below.size()), {{"fs-cdate", ""}, {"fs-mdate", ""}}});
    }
    for (const auto& [name, content] : s_.files) {
      if (!own(name)) continue;
      items.push_back({"fs-file",
                       name.substr(below.size()),
                       {{"fs-cdate", ""},
                        {"fs-mdate", ""},
                        {"fs-size", std::to_string(content.size())},
                        {"fs-readonly", "false"}}});
    }
    return answer(items);
  }
  const auto file = s_.files.find(path);
  if (file == s_.files.end()) return fault(404, kRwsNoPath, "Path does not exist: " + path_);
  if (method_ == "DELETE") {
    s_.files.erase(file);
    return no_content();
  }
  HttpReply reply;
  reply.status = 200;
  reply.headers["Content-Type"] = "application/octet-stream";
  reply.body = file->second;
  return reply;
}

HttpReply RwsHandler::elog() {
  if (method_ != "GET") return fault(400, kRwsBadValue, "Invalid action");
  const auto item = [this](const Event& event, const char* type) -> Item {
    return {type,
            "/rw/elog/0/" + std::to_string(event.number),
            {{"msgtype", std::to_string(event.type)},
             {"code", std::to_string(event.code)},
             {"src-name", "T_ROB1"},
             {"tstamp", calendar(event.at, s_.calendar_set_s)},
             {"title", event.title},
             {"desc", event.text},
             {"conseqs", ""},
             {"causes", ""},
             {"actions", ""},
             {"argc", "0"}}};
  };
  const bool newest_first = !two() || query("order") == "lifo";
  if (two() && query("order") == "lifo" && accept_.find("hal+json;v=2.0") != std::string::npos) {
    HttpReply refused;
    refused.status = 406;  // the order came with v=2.1
    return refused;
  }
  if (segment(2).empty())
    return answer({{"elog-domain-li",
                    "0",
                    {{"domain-name", "Common"}, {"numevts", std::to_string(s_.events.size())}}}});
  const std::string wanted = segment(3);
  Items items;
  for (auto event = s_.events.rbegin(); event != s_.events.rend(); ++event) {
    if (wanted.empty())
      items.push_back(item(*event, "elog-message-li"));
    else if (wanted == std::to_string(event->number))
      return answer({item(*event, "elog-message")});
  }
  if (!wanted.empty()) return fault(404, kRwsNoResource, "No event " + wanted);
  if (!newest_first) std::reverse(items.begin(), items.end());
  std::size_t limit = items.size();
  const std::string text = query("limit");
  std::from_chars(text.data(), text.data() + text.size(), limit);
  if (two()) limit = std::min(limit, kMostOnAPage);
  items.resize(std::min(limit, items.size()));
  return answer(items);
}

}  // namespace weldcell::sim
