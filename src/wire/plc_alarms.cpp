// The alarm list of docs/PLC.md: what a fault number means to the people at the cell.
#include <algorithm>

#include "weldcell/wire/plc_map.hpp"

namespace weldcell::wire {
namespace {

constexpr PlcAlarm kAlarms[] = {
    {10, "EGM frames stopped", PlcSeverity::Fault,
     "no datagram from the robot controller for 0.4 s in a scan",
     "the robot has stopped: the log quotes the controller; clear it there, or mend the network, Arm, "
     "Resume"},
    {11, "EGM did not start", PlcSeverity::Fault, "no running session 30 s after the scan program began",
     "read the event log on the FlexPendant; check UdpUc address and port and the module WeldcellEgm"},
    {12, "motion refused", PlcSeverity::Fault, "the robot is not where the motion begins, or is not armed",
     "the log names the reason; Arm, Resume"},
    {13, "robot stopped", PlcSeverity::Fault, "motors off, emergency stop or program stop at the controller",
     "clear it at the controller; after an emergency stop press Motors On there; Arm, Resume"},
    {20, "laser lost", PlcSeverity::Fault, "its connection closed, or no reading for 0.5 s in a scan",
     "check the sensor's power and network, Arm, Resume"},
    {21, "laser data lost", PlcSeverity::Fault, "the machine was too slow for the readings",
     "close other programs on the controller's computer, Arm, Resume"},
    {30, "robot command failed", PlcSeverity::Fault,
     "the robot controller refused a request or did not answer",
     "the log quotes the controller; mend what it says, Arm, Resume"},
    {31, "weld program stopped early", PlcSeverity::Fault, "RAPID stopped before the last seam",
     "look at the seam at hand and finish it by hand; Arm, Resume goes on with the next one"},
    {40, "PLC lost", PlcSeverity::Fault, "the PLC's heartbeat stood still",
     "mend the PLC's link, Arm, Resume"},
    {50, "stopped by a person", PlcSeverity::Warning, "Stop was ordered", "Arm and Resume, or Abort"},
    {51, "held", PlcSeverity::Warning, "Hold was ordered", "Arm and Unhold, or Abort"},
    {60, "state not saved", PlcSeverity::Fault, "the job's state could not be written to the disk",
     "free space or give back the right to write the spool, Arm, Resume"},
    {kAlarmInterrupted, "job interrupted", PlcSeverity::Warning,
     "a job was found unfinished when the cell started", "make the cell safe; Arm and Resume, or Abort"},
    {kAlarmJobFailed, "job failed", PlcSeverity::Message, "the last job ended without all its welds",
     "read its report, weld manually; Reset"},
    {kAlarmLatency, "laser latency drifted", PlcSeverity::Warning,
     "the last jobs found another latency than the cell file states, by more than twice its sigma",
     "measure it (weldcell calibrate latency); jobs go on, their bounds take the drift in"},
};

constexpr bool ascending() {
  for (std::size_t i = 1; i < std::size(kAlarms); ++i) {
    if (kAlarms[i].number <= kAlarms[i - 1].number) return false;
  }
  return true;
}
static_assert(ascending());

}  // namespace

std::span<const PlcAlarm> plc_alarms() { return kAlarms; }

const PlcAlarm* plc_alarm(std::uint16_t number) {
  const auto found = std::ranges::find(kAlarms, number, &PlcAlarm::number);
  return found == std::end(kAlarms) ? nullptr : &*found;
}

}  // namespace weldcell::wire
