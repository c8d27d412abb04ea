// cell.yaml -> CellConfig: the cell's geometry and limits, its devices' addresses and the daemon's own
// settings.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "weldcell/cell/cell_setup.hpp"
#include "weldcell/files/fault.hpp"
#include "weldcell/wire/laser_dialects.hpp"
#include "weldcell/wire/minisign.hpp"
#include "weldcell/wire/plc_map.hpp"

namespace weldcell::files {

struct Endpoint {
  std::string host = "127.0.0.1";
  int port = 0;  ///< 0: take a free one and say which
};

/// What a constant latency belongs to: it holds for nothing else.
struct LatencyConditions {
  double rate_hz = 0;
  std::string dialect, filter, robot;
  std::string date;  ///< UTC, of the calibration
};

/// How the laser's commands are reached: not at all (od5000: at its address), over a TCP port beside the
/// readings', or in their stream.
enum class LaserCommands { None, Port, InStream };

enum class RealTime { Off, Try, Required };
/// Auto: found out from the controller's first answer.
enum class RwsGenerationChoice { One, Two, Auto };

struct CellConfig {
  std::string path;  ///< of the file
  std::string text;  ///< as read, kept in every record
  cell::CellSetup setup;

  Endpoint egm{"127.0.0.1", 6511};  ///< UDP, we listen
  std::string egm_peer;  ///< only this source address is answered; "" = the first one seen in a session
  Endpoint rws{"127.0.0.1", 8080};
  RwsGenerationChoice rws_generation = RwsGenerationChoice::One;
  std::string rws_certificate_sha256;  ///< 64 lower-case hexadecimal digits, "" with generation 1
  std::string rws_user = "Default User";
  std::string rws_password_file;  ///< secrets never stand in YAML; relative to the cell file; or credential
                                  ///< "rws-password"
  std::string rws_task = "T_ROB1";
  Endpoint laser{"127.0.0.1", 10240};     ///< the sensor; its command port with the dialect od5000
  Endpoint laser_listen{"127.0.0.1", 0};  ///< UDP, we listen: od5000 only
  wire::LaserFormat laser_format;         ///< without a fault
  LaserCommands laser_commands = LaserCommands::Port;
  int laser_command_port = 23;        ///< TCP at the laser's address; LaserCommands::Port only
  std::string laser_password_file;    ///< for a sensor that wants a LOGIN; "" = as delivered
  std::string laser_filter = "none";  ///< the sensor's own averaging or median; part of its latency
  /// Under which the latency was measured; nothing when it was not.
  std::optional<LatencyConditions> latency_measured;
  Endpoint modbus{"127.0.0.1", 1502};     ///< we listen
  std::vector<std::string> modbus_allow;  ///< IPv4 addresses that may connect; empty only on loopback
  int modbus_max_clients = 8;
  wire::WordOrder word_order = wire::WordOrder::Abcd;
  double plc_heartbeat_timeout_s = 3.0;
  bool plc_required = true;  ///< false: operated from the command line only

  std::vector<wire::MinisignKey> job_keys;  ///< who may sign jobs; empty: no signature is checked
  bool unsigned_refused = false;            ///< only with job_keys

  std::string spool_dir = "/var/spool/weldcell";
  std::string state_dir = "/var/lib/weldcell";  ///< control socket, job journal
  std::string cad_cache_dir;                    ///< default: state_dir/cad
  bool projector_window = true;                 ///< SDL window where a display is
  RealTime realtime = RealTime::Try;
};

/// A latency that was measured under other conditions than the cell states now: a fault, but for who measures
/// it anew.
enum class StaleLatency { Fault, Taken };

/// Reads and checks; relative paths are resolved against the file's folder. All faults at once.
std::variant<CellConfig, Faults> read_cell_file(const std::string& path,
                                                StaleLatency stale = StaleLatency::Fault);
/// The same from text, for replay; `name` stands in the faults.
std::variant<CellConfig, Faults> parse_cell(std::string_view text, const std::string& name,
                                            const std::string& robots_dir,
                                            StaleLatency stale = StaleLatency::Fault);

/// An arm model by its name from <robots_dir>/<name>.yaml.
std::variant<kinematics::ArmModel, Faults> read_arm_file(const std::string& path);

}  // namespace weldcell::files
