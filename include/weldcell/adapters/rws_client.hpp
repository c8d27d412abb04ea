// ABB Robot Web Services 1.0 as calls: state, motors, program, files, modules, symbols. Over any carrier; one
// thread at a time.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "weldcell/base/result.hpp"
#include "weldcell/ports/http.hpp"

namespace weldcell::adapters {

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
enum class MastershipDomain : std::uint8_t { Cfg, Motion, Rapid };

const char* to_string(ControllerState);
const char* to_string(OperationMode);
const char* to_string(ExecutionState);
const char* to_string(MastershipDomain);

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
/// own message, `mend` says what to do.
class RwsClient {
 public:
  /// The carrier must outlive the client.
  explicit RwsClient(ports::HttpTransport& transport) : transport_(&transport) {}

  Result<SystemInfo> system();
  Result<ControllerState> controller_state();
  Result<OperationMode> operation_mode();
  Result<ExecutionState> execution_state();
  Result<int> speed_ratio_percent();

  /// Motors on needs automatic mode.
  Status set_motors(bool on);
  /// Starts execution from the program pointer, in every task. `forever` repeats main, otherwise one cycle.
  Status start(bool forever = false);
  Status stop();
  /// Program pointer to main in all tasks. Needs mastership of rapid.
  Status reset_pp();
  Status set_pp_to_routine(std::string_view task, std::string_view module, std::string_view routine);

  Status request_mastership(MastershipDomain domain);
  Status release_mastership(MastershipDomain domain);
  Result<MastershipLease> lease(MastershipDomain domain);

  /// Writes a file on the controller, e.g. "$home/weldcell/job.mod", and reads it back: "rws.mismatch" unless
  /// every byte is equal.
  Status upload_file(std::string_view path, std::string_view text);
  Result<std::string> download_file(std::string_view path);
  Status delete_file(std::string_view path);
  Status make_folder(std::string_view parent, std::string_view name);
  /// Loads a module file into a task. Needs mastership of rapid and a stopped program.
  Status load_module(std::string_view task, std::string_view path, bool replace = true);
  Status unload_module(std::string_view task, std::string_view module);
  Result<std::vector<std::string>> modules(std::string_view task);

  /// Values are RAPID literals: "[[1,2,3],[1,0,0,0]]", "TRUE", "\"text\"".
  Result<std::string> read_symbol(std::string_view task, std::string_view module, std::string_view symbol);
  Status write_symbol(std::string_view task, std::string_view module, std::string_view symbol,
                      std::string_view literal);

  /// Measured axes in degrees.
  Result<std::array<double, 6>> joints_deg(std::string_view mechanical_unit = "ROB_1");
  /// The newest `count` entries, newest first.
  Result<std::vector<ControllerEvent>> event_log(int count = 20);

 private:
  Result<ports::HttpReply> get(std::string path);
  Result<ports::HttpReply> post(std::string path, std::string body);
  Result<ports::HttpReply> checked(ports::HttpRequest request);
  Result<std::string> field(std::string path, std::string_view type, std::string_view name);
  Status command(std::string path, std::string body);

  ports::HttpTransport* transport_;
};

}  // namespace weldcell::adapters
