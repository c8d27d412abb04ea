// What Robot Web Services answer: states and lists in JSON, HAL or XHTML, refusals, subscriptions and their
// event frames. Pure; any bytes are safe.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "weldcell/base/result.hpp"

namespace weldcell::wire {

enum class ControllerState : std::uint8_t {
  Unknown,
  Init,
  MotorsOff,
  MotorsOn,
  GuardStop,
  EmergencyStop,
  EmergencyStopReset,
  SystemFailure
};
enum class OperationMode : std::uint8_t {
  Unknown,
  Init,
  ChangingToAuto,
  ChangingToManualFull,
  ManualReduced,
  ManualFull,
  Auto
};
enum class ExecutionState : std::uint8_t { Unknown, Stopped, Running };

const char* to_string(ControllerState);
const char* to_string(OperationMode);
const char* to_string(ExecutionState);

/// The controller's own words ("motoron", "MANR", "running"); Unknown for others.
ControllerState controller_state_of(std::string_view word);
OperationMode operation_mode_of(std::string_view word);
ExecutionState execution_state_of(std::string_view word);

/// One entry: "_type", "_title", "_self" (the href of its own link, when it has one) and its fields, all as
/// text.
using RwsState = std::map<std::string, std::string>;

/// The entries of a body, JSON of either generation or XHTML, and of the lists inside; 64 levels deep at
/// most. Empty when it is no RWS body.
std::vector<RwsState> rws_states(std::string_view body);
/// A field of an entry, "" when it has none.
std::string rws_field(const RwsState& state, const char* key);
/// The href of the link to the next page, "" on the last.
std::string rws_next_page(std::string_view body);

/// What a reply of status 300 or more says, as an error "rws.<kind>"; `request` stands in `where`. The
/// controller's code and message are quoted.
Error rws_refusal(int status, std::string_view body, const std::string& request);

/// A subscription as its creation was answered.
struct RwsSubscribed {
  std::string group;  ///< to delete it by
  std::string poll;   ///< path of the WebSocket, "/poll/..."
};
/// From the Location header (an URL or a path) and the body. Empty when neither names a WebSocket.
std::optional<RwsSubscribed> rws_subscribed(std::string_view location, std::string_view body);

/// What one event frame tells.
struct RwsNews {
  std::optional<ControllerState> controller;
  std::optional<OperationMode> mode;
  std::optional<ExecutionState> execution;
  std::vector<std::uint32_t> log_entries;  ///< sequence numbers of new entries of the event log
};
RwsNews rws_news(std::string_view frame);

}  // namespace weldcell::wire
