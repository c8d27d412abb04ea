// ABB Robot Web Services as calls, the same for both generations: state, motors, program, files, modules,
// symbols, signals, event log, subscriptions. Over any carrier; one thread at a time.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "weldcell/base/result.hpp"
#include "weldcell/ports/http.hpp"
#include "weldcell/wire/rws_replies.hpp"
#include "weldcell/wire/rws_requests.hpp"

namespace weldcell::adapters {

using wire::ControllerState;
using wire::ExecutionState;
using wire::MastershipDomain;
using wire::OperationMode;
using wire::RwsGeneration;
using wire::to_string;

/// One entry of the controller's event log.
struct ControllerEvent {
  std::uint32_t number = 0;  ///< sequence number in the log
  int type = 0;              ///< 1 information, 2 warning, 3 error
  int code = 0;              ///< e.g. 41822 "No data from the UdpUc device"
  std::string time, title, description, causes, actions;
};

struct SystemInfo {
  std::string name, rapid_version, system_id;  ///< rapid_version is RobotWare's, e.g. "6.16.0163"
  std::vector<std::string> options;
};

struct IoSignal {
  std::string name, type;  ///< type DI, DO, AI, AO, GI, GO
  std::string place;       ///< "net/device/name", or the bare name, to read and write it by
  std::string value;
};

struct SymbolFound {
  std::string url;   ///< "RAPID/T_ROB1/Module/name"
  std::string type;  ///< "num", "robtarget", ...
};

class RwsClient;

/// Mastership of one domain, released when it goes out of scope.
class MastershipLease {
 public:
  MastershipLease(RwsClient& client, MastershipDomain domain) : client_(&client), domain_(domain) {}
  MastershipLease(MastershipLease&& other) noexcept : client_(other.client_), domain_(other.domain_) {
    other.client_ = nullptr;
  }
  MastershipLease& operator=(MastershipLease&&) = delete;
  MastershipLease(const MastershipLease&) = delete;
  ~MastershipLease();
  /// Releases now and tells how it went; the destructor then does nothing.
  Status release();

 private:
  RwsClient* client_;
  MastershipDomain domain_;
};

/// Every error carries a code "rws.<kind>": held, no_mastership, rejected, not_allowed, bad_value,
/// wrong_state, bad_module, not_found, no_path, bad_signal, overloaded, unexpected (a body or status that the
/// protocol does not have), mismatch (read-back); or the carrier's "http.*". `what` quotes the controller's
/// own message and code, `mend` says what to do.
class RwsClient {
 public:
  /// The carrier must outlive the client.
  explicit RwsClient(ports::HttpTransport& transport, RwsGeneration generation = RwsGeneration::One)
      : transport_(&transport), dialect_(generation) {}
  RwsGeneration generation() const { return dialect_.generation(); }
  const wire::RwsDialect& dialect() const { return dialect_; }
  /// The carrier still speaks for the session of an earlier process. Before the first request the mastership
  /// that it may hold is released and `logout` called, which ends it; both again, and the request failing
  /// with their error, until the controller has answered.
  void end_former_session_first(std::function<Status()> logout) { end_former_ = std::move(logout); }

  Result<SystemInfo> system();
  Result<ControllerState> controller_state();
  Result<OperationMode> operation_mode();
  Result<ExecutionState> execution_state();
  Result<int> speed_ratio_percent();

  /// Motors on needs automatic mode.
  Status set_motors(bool on);
  /// Generation 2 needs mastership of rapid.
  Status set_speed_ratio_percent(int percent);
  /// Starts execution from the program pointer, in every task. `forever` repeats main, otherwise one cycle.
  Status start(bool forever = false);
  Status stop();
  /// Program pointer to main in all tasks. Needs mastership of rapid.
  Status reset_pp();
  /// The module in which the program pointer of the task stands; "" when it is not set.
  Result<std::string> pointer_module(std::string_view task);
  Status set_pp_to_routine(std::string_view task, std::string_view module, std::string_view routine);

  Status request_mastership(MastershipDomain domain);
  Status release_mastership(MastershipDomain domain);
  Result<MastershipLease> lease(MastershipDomain domain);

  /// Where the file of a program module of that name belongs: "$home/x.mod" or "HOME/x.modx".
  std::string module_path(std::string_view module) const { return dialect_.module_path(module); }
  /// Writes a file on the controller, e.g. to module_path(), and reads it back: "rws.mismatch" unless every
  /// byte is equal.
  Status upload_file(std::string_view path, std::string_view text);
  Result<std::string> download_file(std::string_view path);
  Status delete_file(std::string_view path);
  Status make_folder(std::string_view parent, std::string_view name);
  /// Loads a module file into a task. Needs mastership of rapid and a stopped program.
  Status load_module(std::string_view task, std::string_view path, bool replace = true);
  Status unload_module(std::string_view task, std::string_view module);
  Result<std::vector<std::string>> modules(std::string_view task);
  Result<std::string> module_text(std::string_view task, std::string_view module);

  /// Values are RAPID literals: "[[1,2,3],[1,0,0,0]]", "TRUE", "\"text\"".
  Result<std::string> read_symbol(std::string_view task, std::string_view module, std::string_view symbol);
  Status write_symbol(std::string_view task, std::string_view module, std::string_view symbol,
                      std::string_view literal);
  /// Data whose name matches the regular expression, in a module or (empty) anywhere in the task.
  Result<std::vector<SymbolFound>> search_symbols(std::string_view task, std::string_view module,
                                                  std::string_view pattern);

  /// Every signal, all pages of the list.
  Result<std::vector<IoSignal>> signals();
  /// By its place in signals(); generation 1 also takes the bare name.
  Result<std::string> read_signal(std::string_view place);
  Status write_signal(std::string_view place, std::string_view value);

  /// Measured axes in degrees.
  Result<std::array<double, 6>> joints_deg(std::string_view mechanical_unit = "ROB_1");
  /// The newest `count` entries, newest first.
  Result<std::vector<ControllerEvent>> event_log(int count = 20);
  Result<ControllerEvent> event(std::uint32_t number);

  /// Creates a subscription; its WebSocket is the caller's matter.
  Result<wire::RwsSubscribed> subscribe(const std::vector<wire::RwsResource>& resources);
  Status unsubscribe(std::string_view group);

 private:
  Status end_former_session();
  Result<ports::HttpReply> checked(wire::RwsAsk ask);
  Result<std::string> field(wire::RwsAsk ask, std::string_view type, std::string_view name);
  Status command(wire::RwsAsk ask);

  ports::HttpTransport* transport_;
  wire::RwsDialect dialect_;
  std::function<Status()> end_former_;
};

}  // namespace weldcell::adapters
