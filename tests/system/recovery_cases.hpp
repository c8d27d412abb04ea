// The cases of docs/RECOVERY.md: what is lost or stopped, when, and what must come of it.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <ostream>
#include <regex>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "weldcell/app/virtual_cell.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/files/fault.hpp"

namespace weldcell::app {

using job::FaultCode;
using job::State;

/// What the PC's side suffers; the scene's faults are the controller's and the sensor's.
enum class Loss { None, Daemon, Processor, PlcHeartbeat };

struct Case {
  std::string name = {};
  std::vector<std::string> faults = {};  ///< as a scene file has them
  FaultCode fault = FaultCode::None;
  std::string text = {};       ///< in the fault's text
  int event = 0;               ///< in the controller's log
  State in = State::Scanning;  ///< where loss and `befalls` come, `after_s` after the state began
  Loss loss = Loss::None;
  double after_s = 4, down_s = 3;
  std::string still_refused =
      {};  ///< what a resume says before the person did more than wait; "" = it goes on
  bool press_motors_on = false;
  bool mastership_held = false;  ///< by the session of the killed daemon
  bool seam_left_out = false;    ///< a seam was cut: finished by hand
  std::size_t never_welded = 0;  ///< seams whose arc was struck and did not travel
  bool seam_finished = false;    ///< the seam under way is welded to its end, and none begins after it
  State goes_on_at = State::PreparingScan;
  bool guidance = false;
  std::function<void(VirtualCell&)> befalls = {};    ///< what happens to the controller
  std::function<void(VirtualCell&)> meanwhile = {};  ///< while the cell stands there
  std::function<void(VirtualCell&)> mend = {};       ///< by a person, before the cell is armed again
};

inline std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.name; }

template <typename T>
T must(std::variant<T, files::Faults> read) {
  if (const auto* faults = std::get_if<files::Faults>(&read)) throw std::runtime_error(files::text(*faults));
  return std::get<T>(std::move(read));
}

inline ports::HttpReply at_the_pendant(VirtualCell& cell, const std::string& method, const std::string& path,
                                       const std::string& body = "") {
  constexpr int kPendant = 77;
  ports::HttpRequest request;
  request.method = method;
  request.path = path;
  request.body = body;
  return cell.controller().handle_rws(request, kPendant);
}

/// Starts the program on the FlexPendant, as far as the controller lets it.
inline void press_start(VirtualCell& cell) {
  const auto reply = at_the_pendant(
      cell, "POST", "/rw/rapid/execution?action=start",
      "regain=continue&execmode=continue&cycle=once&condition=none&stopatbp=disabled&alltaskbytsp=false");
  EXPECT_EQ(reply.status, 204);
}

/// An axis (0..5) bounded in the controller's configuration to +-half_deg about where it stands.
inline std::function<void(VirtualCell&)> bounded(std::size_t axis, double half_deg) {
  return [=](VirtualCell& cell) {
    const double at = cell.controller().joints()[axis];
    cell.controller().bound_axis(axis, at - rad(half_deg), at + rad(half_deg));
  };
}
inline std::function<void(VirtualCell&)> unbounded(std::size_t axis) {
  return [=](VirtualCell& cell) { cell.controller().bound_axis(axis, rad(-180), rad(180)); };
}

/// A target of the weld module changed by hand on the FlexPendant, before the program starts.
inline std::function<void(VirtualCell&)> edited(const std::string& from, const std::string& to) {
  return [=](VirtualCell& cell) {
    ports::HttpReply file;
    for (int cycle = 0; cycle < 2500 && file.status != 200; ++cycle) {
      cell.advance();
      file = at_the_pendant(cell, "GET", "/fileservice/$HOME/WeldcellJob.mod");
    }
    const std::string changed = std::regex_replace(file.body, std::regex(from), to);
    ASSERT_NE(changed, file.body) << "no " << from << " in\n" << file.body;
    ASSERT_FALSE(cell.controller().program_running()) << "too late";
    ASSERT_TRUE(cell.controller().load_module(changed).ok());
  };
}
inline const std::string kTarget = R"((robtarget p01_002:=\[\[)[-0-9.]+(,))", kFarAway = "$019000$2";
inline const std::string kConfiguration =
                             R"((robtarget p02Approach:=\[\[[^\]]*\],\[[^\]]*\],\[[-0-9]+,)[-0-9]+(,))",
                         kOther = "$1-3$2";

inline const std::vector<Case> kCases{
    {.name = "EgmLostInScan", .faults = {"egm_silence@scan+5:3"}, .fault = FaultCode::EgmLost},
    {.name = "NetworkCutInScan",
     .faults = {"egm_silence@scan+5:3", "rws_silence@scan+5:3"},
     .fault = FaultCode::EgmLost,
     .text = "41822",
     .event = 41822},
    {.name = "NetworkCutInWeld",
     .faults = {"egm_silence@weld+1.5:50", "rws_silence@weld+1.5:50"},
     .fault = FaultCode::RobotCommand,
     .event = 80001,
     .seam_finished = true},
    {.name = "CommTimeoutInScan",
     .fault = FaultCode::EgmLost,
     .text = "41822",
     .event = 41822,
     .loss = Loss::Processor},
    {.name = "EgmNeverStarts", .faults = {"egm_silence@0:60"}, .fault = FaultCode::EgmNotStarted},
    {.name = "RwsLostInScan",
     .faults = {"rws_silence@scan+5:100"},
     .fault = FaultCode::RobotCommand,
     .text = "open scan",
     .still_refused = "not reachable"},
    {.name = "LaserLostInScan",
     .faults = {"laser_drop@scan+5:30"},
     .fault = FaultCode::LaserLost,
     .still_refused = "laser is not connected"},
    {.name = "LaserStallsInScan", .faults = {"laser_stall@scan+5:3"}, .fault = FaultCode::LaserLost},
    {.name = "PlcLostInScan", .fault = FaultCode::PlcLost, .text = "heartbeat", .loss = Loss::PlcHeartbeat},
    {.name = "PlcLostInWeld",
     .fault = FaultCode::PlcLost,
     .in = State::Welding,
     .loss = Loss::PlcHeartbeat,
     .seam_left_out = true},
    {.name = "PcCrashInScan", .event = 41822, .loss = Loss::Daemon},
    {.name = "PcCrashInScanAndBackAtOnce", .loss = Loss::Daemon, .down_s = 0.2},
    {.name = "PcCrashInGuidance",
     .in = State::GuideMoving,
     .loss = Loss::Daemon,
     .after_s = 0.5,
     .goes_on_at = State::GuideMoving,
     .guidance = true},
    {.name = "PcCrashInWeld",
     .event = 80001,
     .in = State::Welding,
     .loss = Loss::Daemon,
     .after_s = 1.5,
     .down_s = 60,
     .seam_finished = true},
    {.name = "PcCrashInWeldAndBackAtOnce",
     .event = 10125,
     .in = State::Welding,
     .loss = Loss::Daemon,
     .after_s = 1,
     .down_s = 1,
     .seam_left_out = true},
    {.name = "PcCrashInWeldWithMastershipHeld",
     .event = 10125,
     .in = State::Welding,
     .loss = Loss::Daemon,
     .after_s = 1,
     .down_s = 1,
     .mastership_held = true,
     .seam_left_out = true},
    {.name = "RwsLostInWeld",
     .faults = {"rws_silence@weld+1.5:50"},
     .fault = FaultCode::RobotCommand,
     .event = 80001,
     .seam_finished = true},
    {.name = "RwsLostInWeldForAMoment",
     .faults = {"rws_silence@weld+1:1.5"},
     .fault = FaultCode::RobotCommand,
     .event = 10125,
     .seam_left_out = true},
    {.name = "ControllerRestartInScan",
     .faults = {"restart@scan+5:5"},
     .fault = FaultCode::EgmLost,
     .text = "10045",
     .event = 10045},
    {.name = "ControllerRestartInWeld",
     .faults = {"restart@weld+3:5"},
     .fault = FaultCode::RobotCommand,
     .event = 10045,
     .seam_left_out = true},
    {.name = "EmergencyStopInScan",
     .faults = {"estop@scan+5:3"},
     .fault = FaultCode::EgmLost,
     .text = "10013",
     .event = 10013,
     .still_refused = "press Motors On",
     .press_motors_on = true},
    {.name = "EmergencyStopInWeld",
     .faults = {"estop@weld+3:3"},
     .fault = FaultCode::ProgramStopped,
     .event = 10013,
     .still_refused = "press Motors On",
     .press_motors_on = true,
     .seam_left_out = true},
    {.name = "EmergencyStopStillStands",
     .faults = {"estop@scan+5:40"},
     .fault = FaultCode::EgmLost,
     .text = "10013",
     .event = 10013,
     .still_refused = "emergency stop",
     .press_motors_on = true},
    {.name = "GuardStopInScan",
     .faults = {"guardstop@scan+5:40"},
     .fault = FaultCode::EgmLost,
     .text = "10012",
     .event = 10012,
     .still_refused = "guard"},
    {.name = "GuardStopInWeld",
     .faults = {"guardstop@weld+3:40"},
     .fault = FaultCode::ProgramStopped,
     .event = 10012,
     .still_refused = "guard",
     .seam_left_out = true},
    {.name = "MotorsOffInScan",
     .faults = {"motors_off@scan+5"},
     .fault = FaultCode::EgmLost,
     .text = "10010",
     .event = 10010},
    {.name = "MotorsOffInWeld",
     .faults = {"motors_off@weld+3"},
     .fault = FaultCode::ProgramStopped,
     .event = 10010,
     .seam_left_out = true},
    {.name = "ManualModeInScan",
     .faults = {"manual@scan+5:40"},
     .fault = FaultCode::EgmLost,
     .text = "10015",
     .event = 10015,
     .still_refused = "operation mode"},
    {.name = "ManualModeInWeld",
     .faults = {"manual@weld+3:40"},
     .fault = FaultCode::ProgramStopped,
     .event = 10015,
     .still_refused = "operation mode",
     .seam_left_out = true},
    {.name = "ProgramStoppedInScan",
     .faults = {"program_stop@scan+5"},
     .fault = FaultCode::EgmLost,
     .text = "10125",
     .event = 10125},
    {.name = "ProgramStoppedInWeld",
     .faults = {"program_stop@weld+3"},
     .fault = FaultCode::ProgramStopped,
     .text = "10125",
     .event = 10125,
     .seam_left_out = true},
    {.name = "StartedOnTheFlexPendantAfterAStop",
     .faults = {"program_stop@scan+5"},
     .fault = FaultCode::EgmLost,
     .text = "10125",
     .meanwhile = press_start},
    {.name = "PointerMovedInScan",
     .faults = {"pp_moved@scan+5"},
     .fault = FaultCode::EgmLost,
     .text = "10125",
     .event = 10002},
    {.name = "PointerMovedInWeld",
     .faults = {"pp_moved@weld+3"},
     .fault = FaultCode::ProgramStopped,
     .event = 10002,
     .seam_left_out = true},
    {.name = "OutOfReachInAMove",
     .fault = FaultCode::RobotCommand,
     .text = "50050",
     .event = 50050,
     .in = State::Ready,
     .after_s = 0,
     .goes_on_at = State::GuideMoving,
     .guidance = true,
     .befalls = bounded(2, 0.5),
     .mend = unbounded(2)},
    {.name = "OutOfReachBeforeScan",
     .fault = FaultCode::EgmNotStarted,
     .text = "50050",
     .event = 50050,
     .in = State::Ready,
     .after_s = 0,
     .befalls = bounded(2, 0.5),
     .mend = unbounded(2)},
    {.name = "OutOfReachInWeld",
     .fault = FaultCode::ProgramStopped,
     .text = "50050",
     .event = 50050,
     .in = State::Welding,
     .after_s = 0,
     .seam_left_out = true,
     .never_welded = 1,
     .befalls = edited(kTarget, kFarAway)},
    {.name = "WrongConfigurationInWeld",
     .fault = FaultCode::ProgramStopped,
     .text = "50080",
     .event = 50080,
     .in = State::Welding,
     .after_s = 0,
     .befalls = edited(kConfiguration, kOther)},
    {.name = "JointRangeLeftInScan",
     .fault = FaultCode::EgmLost,
     .text = "50027",
     .event = 50027,
     .befalls = bounded(0, 0.5),
     .mend = unbounded(0)},
    {.name = "SingularityInScan",
     .faults = {"singularity@scan+5"},
     .fault = FaultCode::EgmLost,
     .text = "50027",
     .event = 50027},
    {.name = "SingularityInWeld",
     .faults = {"singularity@weld+3"},
     .fault = FaultCode::ProgramStopped,
     .text = "50026",
     .event = 50026},
    {.name = "SingularityInAMove",
     .faults = {"singularity@0"},
     .fault = FaultCode::RobotCommand,
     .text = "50026",
     .event = 50026,
     .goes_on_at = State::GuideMoving,
     .guidance = true},
    {.name = "CollisionInScan",
     .faults = {"collision@scan+5"},
     .fault = FaultCode::EgmLost,
     .text = "50204",
     .event = 50204},
    {.name = "CollisionInWeld",
     .faults = {"collision@weld+3"},
     .fault = FaultCode::ProgramStopped,
     .text = "50204",
     .event = 50204,
     .seam_left_out = true},
};

}  // namespace weldcell::app
