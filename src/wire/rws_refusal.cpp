#include <nlohmann/json.hpp>
#include <pugixml.hpp>

#include <charconv>

#include "weldcell/wire/rws_replies.hpp"

namespace weldcell::wire {

namespace {

using nlohmann::json;

struct KnownCode {
  int code;
  const char* kind;
  const char* meaning;
  const char* mend;
};

// ABB's return codes, as the reference and client libraries list them.
constexpr KnownCode kKnownCodes[] = {
    {-1073445862, "rws.held", "mastership is held by someone else",
     "let the other client or the pendant release mastership, then try again"},
    {-1073445859, "rws.no_mastership", "mastership is missing",
     "request mastership first; in manual mode the pendant must grant it"},
    {-1073445881, "rws.rejected", "rejected",
     "give the user the grant, or the signal the access level, that this needs"},
    {-1073445867, "rws.not_allowed", "the user is not allowed to do this",
     "give the RWS user the grant for it"},
    {-1073445879, "rws.bad_value", "a parameter has an invalid value, or the task does not exist",
     "check rws.task and the value"},
    {-1073442809, "rws.wrong_state", "execution cannot start in this state",
     "switch to automatic, motors on, program pointer set, then start again"},
    {-1073442813, "rws.bad_module", "the module name is invalid or missing",
     "check the module's name and file"},
    {-1073442816, "rws.not_found", "no such module or symbol",
     "check that the module is loaded and the symbol's name"},
    {-1073414146, "rws.not_found", "no such resource or symbol, or mastership is missing",
     "check the name; request mastership before writing"},
    {-1073445866, "rws.bad_signal", "invalid I/O signal", "check the signal's name"},
    {-1073438713, "rws.no_path", "the path does not exist on the controller", "create the folder first"},
    {-1073438716, "rws.no_path", "no such volume on the controller", "use a path below $home (HOME)"},
    {-1073438708, "rws.no_path", "the module's path is wrong",
     "upload the file first, then load it by the same path"},
    {-1073435873, "rws.held", "another control station has the write access",
     "release the write access of the other control station"},
    {-1073435870, "rws.held", "another control station has the write access",
     "release the write access of the other control station"},
};

struct Refusal {
  int code = 0;
  std::string message;
};

int code_of(std::string_view text) {
  int code = 0;
  std::from_chars(text.data(), text.data() + text.size(), code);
  return code;
}

std::string text_of(const json& value) {
  return value.is_string() ? value.get<std::string>() : value.is_primitive() ? value.dump() : std::string();
}

Refusal refusal_of_json(std::string_view body) {
  const json root = json::parse(body, nullptr, false);
  if (!root.is_object()) return {};
  for (const json* place : {&root, root.contains("_embedded") ? &root["_embedded"] : &root}) {
    if (!place->is_object() || !place->contains("status") || !(*place)["status"].is_object()) continue;
    const json& status = (*place)["status"];
    Refusal out;
    if (status.contains("code")) out.code = code_of(text_of(status["code"]));
    if (status.contains("msg")) out.message = text_of(status["msg"]);
    return out;
  }
  return {};
}

struct SpanFinder final : pugi::xml_tree_walker {
  bool for_each(pugi::xml_node& node) override {
    const std::string_view name = node.name(), which = node.attribute("class").value();
    if (name != "span" && !name.ends_with(":span")) return true;
    if (which == "code" && out.code == 0) out.code = code_of(node.child_value());
    if (which == "msg" && out.message.empty()) out.message = node.child_value();
    return true;
  }
  Refusal out;
};

Refusal refusal_of_xhtml(std::string_view body) {
  pugi::xml_document document;
  if (!document.load_buffer(body.data(), body.size())) return {};
  SpanFinder finder;
  document.traverse(finder);
  return finder.out;
}

}  // namespace

Error rws_refusal(int status, std::string_view body, const std::string& request) {
  const std::size_t first = body.find_first_not_of(" \t\r\n");
  const bool is_json = first != std::string_view::npos && body[first] == '{';
  const Refusal refusal = is_json ? refusal_of_json(body) : refusal_of_xhtml(body);
  std::string quoted = "HTTP " + std::to_string(status);
  if (refusal.code != 0) quoted += ", code " + std::to_string(refusal.code);
  if (!refusal.message.empty()) quoted += ", \"" + refusal.message + "\"";
  const std::string where = "rws " + request;
  for (const KnownCode& known : kKnownCodes) {
    if (known.code == refusal.code)
      return {known.kind, where, std::string(known.meaning) + " (" + quoted + ")", known.mend};
  }
  const auto error = [&](const char* kind, const char* what, const char* mend) {
    return Error{kind, where, std::string(what) + " (" + quoted + ")", mend};
  };
  const char* const look_up = "look the code up with GET /rw/retcode?code=N";
  switch (status) {
    case 403:
      return error("rws.not_allowed", "the controller refused", look_up);
    case 404:
      return error("rws.not_found", "the controller refused", look_up);
    case 406:
    case 415:
      return error("rws.unexpected", "the controller does not speak this generation of RWS",
                   "set rws.generation to 1 for IRC5 and to 2 for OmniCore");
    case 410:
      return error("rws.unexpected",
                   "the controller has no mastership service (RobotWare 8 control stations)",
                   "RobotWare 8 is not supported; use RobotWare 6 or 7");
    case 503:
      return error("rws.overloaded", "the controller has no session or time left",
                   "end other RWS clients; sessions end by themselves after 5 minutes");
    default:
      return error("rws.unexpected", "the controller refused", look_up);
  }
}

}  // namespace weldcell::wire
