#include "rws_replies.hpp"

#include <nlohmann/json.hpp>
#include <pugixml.hpp>

#include <cstdlib>

namespace weldcell::adapters {
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
    {-1073445862, "rws.held", "someone else holds it",
     "let the other client or the pendant release mastership"},
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
    {-1073438716, "rws.no_path", "no such volume on the controller", "use a path below $home"},
    {-1073438708, "rws.no_path", "the module's path is wrong",
     "upload the file first, then load it by the same path"},
};

std::string text_of(const json& value) { return value.is_string() ? value.get<std::string>() : value.dump(); }

void collect(const json& node, std::vector<RwsState>& out) {
  if (node.is_array()) {
    for (const json& item : node) collect(item, out);
    return;
  }
  if (!node.is_object()) return;
  RwsState state;
  for (const auto& [key, value] : node.items()) {
    if (value.is_primitive())
      state[key] = text_of(value);
    else if (key != "_links")
      collect(value, out);
  }
  if (state.contains("_type")) {
    std::string& type = state["_type"];
    // Some controllers put blanks behind the type.
    type.erase(type.find_last_not_of(' ') + 1);
    out.push_back(std::move(state));
  }
}

struct Refusal {
  int code = 0;
  std::string message;
};

Refusal refusal_of_json(std::string_view body) {
  const json root = json::parse(body, nullptr, false);
  if (!root.is_object()) return {};
  for (const json* place : {&root, root.contains("_embedded") ? &root["_embedded"] : &root}) {
    if (!place->is_object() || !place->contains("status") || !(*place)["status"].is_object()) continue;
    const json& status = (*place)["status"];
    Refusal out;
    if (status.contains("code")) out.code = std::atoi(text_of(status["code"]).c_str());
    if (status.contains("msg")) out.message = text_of(status["msg"]);
    return out;
  }
  return {};
}

Refusal refusal_of_xhtml(std::string_view body) {
  pugi::xml_document document;
  if (!document.load_buffer(body.data(), body.size())) return {};
  const auto span_of = [&](const char* name) {
    const std::string path = std::string("//*[local-name()='span'][@class='") + name + "']";
    return std::string(document.select_node(path.c_str()).node().child_value());
  };
  return {std::atoi(span_of("code").c_str()), span_of("msg")};
}

const char* kind_of_status(int status) {
  switch (status) {
    case 403:
      return "rws.not_allowed";
    case 404:
      return "rws.not_found";
    case 503:
      return "rws.overloaded";
    default:
      return "rws.unexpected";
  }
}

}  // namespace

std::vector<RwsState> rws_states(std::string_view body) {
  std::vector<RwsState> out;
  const json root = json::parse(body, nullptr, false);
  if (root.is_object()) collect(root, out);
  return out;
}

Error rws_error(const ports::HttpReply& reply, const std::string& request) {
  const std::size_t first = reply.body.find_first_not_of(" \t\r\n");
  const bool is_json = first != std::string::npos && reply.body[first] == '{';
  const Refusal refusal = is_json ? refusal_of_json(reply.body) : refusal_of_xhtml(reply.body);
  std::string quoted = "HTTP " + std::to_string(reply.status);
  if (refusal.code != 0) quoted += ", code " + std::to_string(refusal.code);
  if (!refusal.message.empty()) quoted += ", \"" + refusal.message + "\"";
  for (const KnownCode& known : kKnownCodes) {
    if (known.code == refusal.code)
      return {known.kind, "rws " + request, std::string(known.meaning) + " (" + quoted + ")", known.mend};
  }
  if (reply.status == 503)
    return {"rws.overloaded", "rws " + request, "the controller has no session or time left (" + quoted + ")",
            "end other RWS clients; sessions end by themselves after 5 minutes"};
  return {kind_of_status(reply.status), "rws " + request, "the controller refused (" + quoted + ")",
          "look the code up with GET /rw/retcode?code=N"};
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

}  // namespace weldcell::adapters
