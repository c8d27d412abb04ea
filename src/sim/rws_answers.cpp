// The bodies of RWS answers: JSON, HAL and XHTML of both generations, as the client asked for them.
#include <nlohmann/json.hpp>

#include "sim/controller_state.hpp"
#include "sim/rws_handler.hpp"

namespace weldcell::sim {

using ports::HttpReply;

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

std::string xhtml_head(const std::string& title) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?><html "
         "xmlns=\"http://www.w3.org/1999/xhtml\"><head><title>" +
         title + "</title><base href=\"http://localhost/\"/></head><body>";
}

namespace {

template <typename Item>
nlohmann::ordered_json part_json(const Item& part) {
  nlohmann::ordered_json out{{"_type", part.type}, {"_title", part.title}};
  for (const auto& [key, value] : part.fields) out[key] = value;
  return out;
}

}  // namespace

HttpReply RwsHandler::hal(const Items& items, const std::string& next) const {
  nlohmann::ordered_json all, states = nlohmann::ordered_json::array(), list = states;
  for (const Item& item : items) {
    const bool in_list = item.type.ends_with("-li");
    nlohmann::ordered_json one;
    if (in_list) one["_links"]["self"]["href"] = escaped(item.title);
    one["_type"] = item.type;
    one["_title"] = item.title;
    for (const auto& [key, value] : item.fields) one[key] = value;
    for (const Item& part : item.parts) one["attrib"].push_back(part_json(part));
    (in_list ? list : states).push_back(std::move(one));
  }
  all["_links"]["base"]["href"] = "https://localhost" + path_.substr(0, path_.rfind('/') + 1);
  all["_links"]["self"]["href"] = segments_.empty() ? "" : segments_.back();
  if (!next.empty()) all["_links"]["next"]["href"] = escaped(next);
  all["status"]["code"] = 294912;
  if (!states.empty()) all["state"] = std::move(states);
  if (!list.empty()) all["_embedded"]["resources"] = std::move(list);
  HttpReply reply;
  reply.status = 200;
  reply.headers["Content-Type"] = accept_;
  reply.body = all.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  return reply;
}

HttpReply RwsHandler::answer(const Items& items, const std::string& next) const {
  if (two() && accept_.find("hal+json") != std::string::npos) return hal(items, next);
  HttpReply reply;
  reply.status = 200;
  if (!two() && query("json") == "1") {
    nlohmann::ordered_json states = nlohmann::ordered_json::array();
    for (const Item& item : items) {
      nlohmann::ordered_json one{{"_type", item.type}, {"_title", item.title}};
      for (const auto& [key, value] : item.fields) one[key] = value;
      for (const Item& part : item.parts) one["attrib"].push_back(part_json(part));
      states.push_back(std::move(one));
    }
    nlohmann::ordered_json all;
    all["_links"]["base"]["href"] = "http://localhost" + path_.substr(0, path_.rfind('/') + 1);
    all["_embedded"]["_state"] = std::move(states);
    reply.headers["Content-Type"] = "application/json";
    reply.body = all.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
    return reply;
  }
  reply.headers["Content-Type"] = two() ? "application/xhtml+xml;v=2.0" : "application/xhtml+xml";
  reply.body = xhtml_head(escaped(segment(0))) + "<div class=\"state\"><a href=\"" + escaped(path_) +
               "\" rel=\"self\"></a>";
  if (!next.empty()) reply.body += "<a href=\"" + escaped(next) + "\" rel=\"next\"></a>";
  reply.body += "<ul>";
  for (const Item& item : items) {
    reply.body += "<li class=\"" + item.type + "\" title=\"" + escaped(item.title) + "\">";
    for (const auto& [key, value] : item.fields) {
      reply.body += "<span class=\"" + key + "\">" + escaped(value) + "</span>";
    }
    if (!item.parts.empty()) {
      reply.body += "<ul>";
      for (const Item& part : item.parts) {
        // librws looks for another class than the later clients.
        reply.body += "<li class=\"" + part.type + (two() ? "" : "-li") + "\" title=\"" +
                      escaped(part.title) + "\"><span class=\"value\">" + escaped(part.fields[0].second) +
                      "</span></li>";
      }
      reply.body += "</ul>";
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
  const bool hal = two() && accept_.find("hal+json") != std::string::npos;
  if (hal || (!two() && query("json") == "1")) {
    nlohmann::ordered_json all;
    all["_links"]["base"]["href"] = hal ? "https://localhost/" : "http://localhost/";
    nlohmann::ordered_json& place = hal ? all : all["_embedded"];
    place["status"] = {{"code", code}, {"msg", message}};
    if (!hal) place["_state"] = nlohmann::ordered_json::array();
    reply.headers["Content-Type"] = hal ? accept_ : "application/json";
    reply.body = all.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  } else {
    reply.headers["Content-Type"] = two() ? "application/xhtml+xml;v=2.0" : "application/xhtml+xml";
    reply.body = xhtml_head("error") + "<div class=\"status\"><span class=\"code\">" + std::to_string(code) +
                 "</span><span class=\"msg\">" + escaped(message) + "</span></div></body></html>";
  }
  return reply;
}

HttpReply RwsHandler::no_content() {
  HttpReply reply;
  reply.status = 204;
  return reply;
}

}  // namespace weldcell::sim
