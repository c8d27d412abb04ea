// Runs the talk over a laser's command port on a socket. Blocking, before the readings start; not real-time.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "weldcell/base/result.hpp"
#include "weldcell/base/time.hpp"
#include "weldcell/wire/laser_setup.hpp"

namespace weldcell::adapters {

struct TalkLimits {
  Nanoseconds answer = 2 * kSecond;  ///< to wait for one answer
  int tries = 1;                     ///< how often a request is sent that nobody answers: datagrams get lost
  std::function<void()> beat;        ///< called between two requests; may be empty
};

/// Carries the talk out over a connected socket to its end. The sensor's notes; errors: those of the talk and
/// "laser.timeout", "laser.refused" with where as the device.
Result<std::vector<std::string>> talk_to_laser(int fd, const std::string& device, wire::LaserSetup& setup,
                                               const TalkLimits& limits);

/// The same over a TCP command port of its own, connected for the talk and closed after it.
Result<std::vector<std::string>> set_up_laser(const std::string& host, int command_port,
                                              wire::LaserWanted wanted, const TalkLimits& limits);

}  // namespace weldcell::adapters
