// What the controller says of itself in EGM frames beside the joints: utilization, motion control's state,
// convergence. Gathers figures for status and report, and tells each trouble once. Pure.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "weldcell/job/cell.hpp"
#include "weldcell/wire/egm.hpp"

namespace weldcell::app {

struct EgmFigures {
  std::uint64_t frames = 0;  ///< read since the begin
  // As the last frame said it.
  double utilization_percent = 0;  ///< above 100 the controller cuts what it is asked for
  wire::MotorState motors = wire::MotorState::Undefined;
  wire::MciState mci = wire::MciState::Undefined;
  wire::RapidState rapid = wire::RapidState::Undefined;
  bool converged = false;
  // Since the begin.
  double peak_percent = 0;       ///< highest utilization while a motion was followed
  std::uint64_t overloaded = 0;  ///< frames above 100 % while a motion was followed
  std::uint64_t limited = 0;     ///< references that our own limits cut
  std::uint64_t stale = 0;       ///< frames that came too late to be answered
  std::uint64_t malformed = 0;   ///< datagrams that were no frame
};

class EgmWatch {
 public:
  void on(const job::EgmCycle& cycle);
  const EgmFigures& figures() const { return figures_; }
  /// In words, since the last call. Overload and convergence are told once a motion, an error once a session.
  std::vector<std::string> take_warnings();

 private:
  /// Counters of the session that grow for ever: what they gained.
  struct Counted {
    std::uint32_t last = 0;
    bool known = false;
    std::uint64_t gain(std::uint32_t now);
  };
  void warn(const wire::EgmFeedback& now, const robot::EgmReport& report);

  std::unique_ptr<wire::EgmCodec> codec_ = std::make_unique<wire::EgmCodec>();
  EgmFigures figures_;
  Counted limited_, stale_, malformed_;
  std::uint64_t overload_told_ = 0, convergence_told_ = 0;  ///< plan
  std::uint32_t error_told_ = 0;                            ///< session
  std::vector<std::string> warnings_;
};

const char* to_string(wire::MotorState);
const char* to_string(wire::MciState);
const char* to_string(wire::RapidState);

}  // namespace weldcell::app
