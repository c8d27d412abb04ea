// A laser's own command interpreter, one for each family of commands, written from the manuals. It keeps and
// answers settings; the simulated readings follow the cell file alone, but for the output, which it switches.
// Pure.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "weldcell/wire/laser_dialects.hpp"

namespace weldcell::sim {

class LaserInterpreter {
 public:
  virtual ~LaserInterpreter() = default;
  /// Characters of one client as they come, in any pieces; returns what the sensor sends back.
  virtual std::string hear(std::string_view bytes) = 0;
  /// Forgets a half-heard command: another client.
  virtual void hang_up() = 0;
  /// False while the sensor has been told to send no readings.
  virtual bool sending() const = 0;
};

/// The interpreter of a sensor with these settings. `data_port`: where its readings are fetched. Never null;
/// the OD5000's commands are LaserPushServer's.
std::unique_ptr<LaserInterpreter> make_interpreter(const wire::LaserFormat& settings, int data_port);

}  // namespace weldcell::sim
