// The subscriptions of the simulated controller: groups of resources, their limits, and the event frames that
// are due. Time is an argument. Pure.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "weldcell/ports/http.hpp"
#include "weldcell/sim/controller.hpp"

namespace weldcell::sim {

inline constexpr std::size_t kRwsMostResources = 1000;  ///< of a group
inline constexpr std::size_t kRwsMostGroups = 2;        ///< of a client, generation 1
inline constexpr std::size_t kRwsMostQuick = 64;        ///< with high priority, of a client

class RwsSubscriptions {
 public:
  using Observe = std::function<std::optional<RwsObserved>(const std::string& uri)>;

  explicit RwsSubscriptions(int generation) : generation_(generation) {}

  /// POST /subscription, PUT and DELETE /subscription/{id}. `host` stands in the Location header.
  ports::HttpReply handle(const ports::HttpRequest& request, int session, const std::string& host,
                          const Observe& observe, double now_s);

  enum class Open { Granted, NotFound, Forbidden };
  /// A client asks for the WebSocket of a group.
  Open open(const std::string& id, int session);
  /// The WebSocket ended: generation 2 cannot open it again.
  void closed(const std::string& id);
  bool exists(const std::string& id) const { return groups_.contains(id); }
  /// Event frames that are due, oldest first.
  std::vector<std::string> frames(const std::string& id, const Observe& observe, double now_s);

  void end_session(int session);
  void forget_all() { groups_.clear(); }
  std::size_t count() const { return groups_.size(); }

 private:
  struct Resource {
    std::string uri;
    int priority = 0;
    std::optional<RwsObserved> told;
    double due_s = 0;
  };
  struct Group {
    int session = 0;
    bool open = false;
    std::vector<Resource> resources;
  };
  /// The resources a form asks for; an error reply when one of them cannot be had.
  std::optional<ports::HttpReply> add(Group& group, const std::string& body, const Observe& observe,
                                      double now_s) const;
  ports::HttpReply created(const std::string& id, const Group& group, const std::string& host) const;
  std::size_t quick_of(int session) const;

  int generation_;
  int next_ = 1;
  std::map<std::string, Group> groups_;
};

}  // namespace weldcell::sim
