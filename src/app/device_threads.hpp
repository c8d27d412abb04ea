// The bodies of the daemon's device threads; each owns one adapter and speaks to the others through the
// wiring only.
#pragma once

#include <string>

#include "app/resident_modules.hpp"
#include "app/wiring.hpp"
#include "weldcell/adapters/egm_udp.hpp"
#include "weldcell/adapters/modbus_server.hpp"

namespace weldcell::app {

/// Real-time: datagram in, reply out, item to the cell.
void run_egm(Wiring& wiring, adapters::EgmSocket& socket);
/// Keeps the laser connected and its bytes flowing to the cell while a scan wants them.
void run_laser(Wiring& wiring);
/// Robot requests over RWS, one at a time; beside them a subscription tells what the controller does.
void run_rws(Wiring& wiring, const std::string& password, const ResidentModules& resident);
/// Tells the cell that a device came or went.
void report_link(Wiring& wiring, job::Link link, bool up, const std::string& detail);
/// The PLC's server: orders to the cell, status back, heartbeats both ways.
void run_plc(Wiring& wiring, adapters::ModbusServer& server);
/// Window and PNG of what the worker sees.
void run_projector(Wiring& wiring);
/// Heavy steps, one after the other.
void run_solver(Wiring& wiring);

}  // namespace weldcell::app
