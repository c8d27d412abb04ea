#include "sim/rws_subscriptions.hpp"

#include <algorithm>

#include "sim/rws_handler.hpp"

namespace weldcell::sim {

using ports::HttpReply;

namespace {

/// Seconds until a change is told, by priority: low, medium, high.
constexpr double kDelay_s[] = {5, 0.2, 0.05};

std::string entry(const RwsObserved& seen) {
  std::string out = "<li class=\"" + seen.type + "\" title=\"" + escaped(seen.title) + "\"><a href=\"" +
                    escaped(seen.self) + "\" rel=\"self\"/>";
  for (const auto& [key, value] : seen.fields)
    out += "<span class=\"" + key + "\">" + escaped(value) + "</span>";
  return out + "</li>";
}

HttpReply refused(int status, long code, const std::string& text) {
  HttpReply reply;
  reply.status = status;
  reply.headers["Content-Type"] = "application/xhtml+xml";
  reply.body = xhtml_head("error") + "<div class=\"status\"><span class=\"code\">" + std::to_string(code) +
               "</span><span class=\"msg\">rws_subscription.cpp[91] " + escaped(text) +
               " code:" + std::to_string(code) + " icode:-1</span></div></body></html>";
  return reply;
}

}  // namespace

std::size_t RwsSubscriptions::quick_of(int session) const {
  std::size_t out = 0;
  for (const auto& [id, group] : groups_) {
    if (group.session != session) continue;
    out += static_cast<std::size_t>(std::ranges::count(group.resources, 2, &Resource::priority));
  }
  return out;
}

std::optional<HttpReply> RwsSubscriptions::add(Group& group, const std::string& body, const Observe& observe,
                                               double now_s) const {
  // Clients number from 0 or from 1, repeat `resources` or give it once: what counts are the pairs
  // themselves.
  const auto form = parse_form(body);
  std::vector<Resource> fresh;
  for (const auto& [key, uri] : form) {
    if (key == "resources" || key.ends_with("-p")) continue;
    if (uri.empty() || uri.front() != '/')
      return refused(400, kRwsBadValue, "Invalid resource '" + uri + "'");
    Resource resource;
    resource.uri = uri;
    const auto priority = form.find(key + "-p");
    const std::string text = priority == form.end() ? "" : priority->second;
    if (text != "0" && text != "1" && text != "2")
      return refused(400, kRwsBadValue, "Invalid priority of " + uri);
    resource.priority = text[0] - '0';
    resource.told = observe(uri);
    resource.due_s = now_s;
    if (!resource.told) return refused(400, kRwsNoResource, "Resource cannot be subscribed: " + uri);
    if (resource.priority == 2 && !resource.told->quick)
      return refused(400, kRwsBadValue, "High priority is for IO signals and persistents only: " + uri);
    fresh.push_back(std::move(resource));
  }
  if (!form.contains("resources") || fresh.empty()) return refused(400, kRwsBadValue, "No resources");
  if (group.resources.size() + fresh.size() > kRwsMostResources)
    return refused(400, kRwsBadValue, "More than 1000 resources in a group");
  const auto quick = static_cast<std::size_t>(std::ranges::count(fresh, 2, &Resource::priority));
  if (quick_of(group.session) + quick > kRwsMostQuick)
    return refused(400, kRwsBadValue, "More than 64 resources of high priority");
  group.resources.insert(group.resources.end(), fresh.begin(), fresh.end());
  return std::nullopt;
}

HttpReply RwsSubscriptions::created(const std::string& id, const Group& group,
                                    const std::string& host) const {
  const std::string poll = (generation_ == 2 ? "wss://" : "ws://") + host + "/poll/" + id;
  HttpReply reply;
  reply.status = 201;
  reply.headers["Location"] = poll;
  reply.headers["Content-Type"] = generation_ == 2 ? "application/xhtml+xml;v=2.0" : "application/xhtml+xml";
  reply.body = xhtml_head("subscription") + "<div class=\"state\"><a href=\"subscription/" + id +
               "\" rel=\"group\"></a><a href=\"" + poll + "\" rel=\"self\"></a><ul>";
  for (const Resource& resource : group.resources) reply.body += entry(*resource.told);
  reply.body += "</ul></div></body></html>";
  return reply;
}

HttpReply RwsSubscriptions::handle(const ports::HttpRequest& request, int session, const std::string& host,
                                   const Observe& observe, double now_s) {
  const std::string path = request.path.substr(0, request.path.find('?'));
  if (path == "/subscription") {
    if (request.method != "POST") return refused(405, kRwsBadValue, "Only POST creates a subscription");
    const auto own =
        std::ranges::count_if(groups_, [&](const auto& g) { return g.second.session == session; });
    if (generation_ == 1 && static_cast<std::size_t>(own) >= kRwsMostGroups)
      return refused(403, kRwsRejected, "More than 2 subscription groups");
    Group group;
    group.session = session;
    if (auto error = add(group, request.body, observe, now_s)) return *error;
    const std::string id = std::to_string(next_++);
    return created(id, groups_[id] = std::move(group), host);
  }
  const auto group = groups_.find(path.substr(path.rfind('/') + 1));
  if (group == groups_.end() || group->second.session != session)
    return refused(404, kRwsNoResource, "No subscription " + path);
  HttpReply reply;
  reply.status = 200;
  if (request.method == "DELETE") {
    groups_.erase(group);
    return reply;
  }
  if (request.method != "PUT") return refused(405, kRwsBadValue, "PUT adds resources, DELETE ends");
  if (auto error = add(group->second, request.body, observe, now_s)) return *error;
  return reply;
}

RwsSubscriptions::Open RwsSubscriptions::open(const std::string& id, int session) {
  const auto group = groups_.find(id);
  if (group == groups_.end() || group->second.open) return Open::NotFound;
  if (group->second.session != session) return Open::Forbidden;
  group->second.open = true;
  return Open::Granted;
}

void RwsSubscriptions::closed(const std::string& id) {
  const auto group = groups_.find(id);
  if (group == groups_.end()) return;
  group->second.open = false;
  if (generation_ == 2) groups_.erase(group);
}

std::vector<std::string> RwsSubscriptions::frames(const std::string& id, const Observe& observe,
                                                  double now_s) {
  std::vector<std::string> out;
  const auto group = groups_.find(id);
  if (group == groups_.end()) return out;
  std::string entries;
  for (Resource& resource : group->second.resources) {
    if (now_s < resource.due_s) continue;
    auto seen = observe(resource.uri);
    if (!seen || seen == resource.told) continue;
    resource.due_s = now_s + kDelay_s[resource.priority];
    // Every entry of the event log is told, also when several came at once.
    if (seen->type == "elog-message-ev") {
      const long last = std::stol(seen->fields[0].second);
      for (long n = std::max(std::stol(resource.told->fields[0].second) + 1, last - 20); n <= last; ++n) {
        RwsObserved one = *seen;
        one.title = one.self = "/rw/elog/0/" + std::to_string(n);
        one.fields[0].second = std::to_string(n);
        entries += entry(one);
      }
    } else {
      entries += entry(*seen);
    }
    resource.told = std::move(seen);
  }
  if (!entries.empty()) {
    out.push_back(xhtml_head("Event") + "<div class=\"state\"><a href=\"subscription/" + id +
                  "\" rel=\"group\"/><ul>" + entries + "</ul></div></body></html>");
  }
  return out;
}

void RwsSubscriptions::end_session(int session) {
  std::erase_if(groups_, [session](const auto& g) { return g.second.session == session; });
}

}  // namespace weldcell::sim
