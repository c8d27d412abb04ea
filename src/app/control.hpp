// What the command line may ask of the daemon over its control socket. Main thread.
#pragma once

#include "app/wiring.hpp"
#include "weldcell/adapters/control_socket.hpp"

namespace weldcell::app {

Result<adapters::ControlSocket> open_control(Wiring& wiring);

}  // namespace weldcell::app
