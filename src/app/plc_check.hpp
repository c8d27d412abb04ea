// The rules of docs/PLC.md put to a Modbus server, one after the other, over the wire alone. Blocking,
// caller's thread.
#pragma once

#include <string>

#include "app/plc_findings.hpp"

namespace weldcell::app {

struct PlcCheckOptions {
  std::string host = "127.0.0.1";
  int port = 502;
  bool read_only = false;  ///< nothing is written: for a cell with a job under way
};

/// Sends no command that moves anything: only None and one number that is no command. A server that cannot be
/// reached fails the first rule, and that is the only one then.
PlcFindings check_plc_server(const PlcCheckOptions& options);

}  // namespace weldcell::app
