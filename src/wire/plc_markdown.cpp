#include <fmt/format.h>

#include <algorithm>

#include "weldcell/wire/plc_map.hpp"

namespace weldcell::wire {
namespace {

struct Number {
  unsigned value;
  const char* name;
  const char* meaning;
};

constexpr Number kCommands[] = {
    {static_cast<unsigned>(PlcCommand::None), "None", "does nothing"},
    {static_cast<unsigned>(PlcCommand::Reset), "Reset", "from Stopped or Complete to Idle"},
    {static_cast<unsigned>(PlcCommand::Start), "Start", "begin the job named by job_number"},
    {static_cast<unsigned>(PlcCommand::Stop), "Stop", "ramp to rest: state Stopped, the job can be resumed"},
    {static_cast<unsigned>(PlcCommand::Hold), "Hold", "in Execute: ramp to rest, state Held"},
    {static_cast<unsigned>(PlcCommand::Unhold), "Unhold", "in Held, armed again: go on at the named step"},
    {static_cast<unsigned>(PlcCommand::Suspend), "Suspend",
     "always refused: nothing upstream or downstream holds the cell"},
    {static_cast<unsigned>(PlcCommand::Unsuspend), "Unsuspend", "always refused"},
    {static_cast<unsigned>(PlcCommand::Abort), "Abort",
     "ramp to rest and end the job as failed: state Stopped"},
    {static_cast<unsigned>(PlcCommand::Clear), "Clear",
     "acknowledge a fault: from Aborted to Stopped; nothing moves by it"},
    {static_cast<unsigned>(PlcCommand::Arm), "Arm",
     "a person allows motion; needed at every start and after every fault, which it acknowledges too"},
    {static_cast<unsigned>(PlcCommand::Confirm), "Confirm", "the worker has placed what the projector shows"},
    {static_cast<unsigned>(PlcCommand::Resume), "Resume", "go on with an interrupted job at its named step"},
    {static_cast<unsigned>(PlcCommand::Select), "Select",
     "the job of job_number comes next, also in place of one that stands ready; 0 takes the choice back"},
};

constexpr Number kResults[] = {
    {static_cast<unsigned>(PlcResult::Done), "done", "the command was taken"},
    {static_cast<unsigned>(PlcResult::Refused), "refused", "not in this state"},
    {static_cast<unsigned>(PlcResult::Unknown), "unknown", "no such command"},
    {static_cast<unsigned>(PlcResult::NotArmed), "not armed", "a person must arm first"},
    {static_cast<unsigned>(PlcResult::LinkMissing), "link missing",
     "robot controller, laser or the PLC's own heartbeat"},
    {static_cast<unsigned>(PlcResult::OtherJob), "other job",
     "Start names another job than the one that stands ready"},
};

constexpr Number kModes[] = {
    {static_cast<unsigned>(PackMode::Invalid), "Invalid", "never sent"},
    {static_cast<unsigned>(PackMode::Production), "Production", "the only mode in which the cell runs jobs"},
    {static_cast<unsigned>(PackMode::Maintenance), "Maintenance", "not used by this version"},
    {static_cast<unsigned>(PackMode::Manual), "Manual", "not used by this version"},
};

constexpr const char* kStates[] = {"Undefined", "Clearing",   "Stopped",   "Starting",   "Idle",
                                   "Suspended", "Execute",    "Stopping",  "Aborting",   "Aborted",
                                   "Holding",   "Held",       "Unholding", "Suspending", "Unsuspending",
                                   "Resetting", "Completing", "Complete"};
static_assert(std::size(kStates) == static_cast<std::size_t>(PackState::Complete) + 1);

const char* type_name(PlcType type) {
  switch (type) {
    case PlcType::Word:
      return "WORD";
    case PlcType::Long:
      return "DINT";
    case PlcType::Real:
      return "REAL";
  }
  return "";
}

void add_registers(std::string& out, std::span<const PlcRegister> registers, unsigned base, unsigned words) {
  out += "| address (from 0) | register | name | type | unit | meaning |\n|---|---|---|---|---|---|\n";
  unsigned free = 0;
  const auto add_reserved = [&](unsigned until) {
    if (free >= until) return;
    out += fmt::format("| {} | {} | reserved | {} WORD | | 0 |\n",
                       until - free == 1 ? fmt::format("{}", base + free)
                                         : fmt::format("{}-{}", base + free, base + until - 1),
                       until - free == 1 ? fmt::format("{}", 40001 + base + free)
                                         : fmt::format("{}-{}", 40001 + base + free, 40000 + base + until),
                       until - free);
  };
  for (const PlcRegister& reg : registers) {
    add_reserved(reg.offset);
    const unsigned address = base + reg.offset, size = reg.type == PlcType::Word ? 1 : 2;
    out += fmt::format("| {} | {} | {} | {} | {} | {} |\n", address, 40001 + address, reg.name,
                       type_name(reg.type), reg.unit, reg.meaning);
    free = reg.offset + size;
  }
  add_reserved(words);
}

void add_numbers(std::string& out, std::string_view heading, std::span<const Number> numbers) {
  out += fmt::format("\n### {}\n\n| number | name | meaning |\n|---|---|---|\n", heading);
  for (const Number& n : numbers) out += fmt::format("| {} | {} | {} |\n", n.value, n.name, n.meaning);
}

void add_alarms(std::string& out) {
  out += "\n### Alarm list\n\n| number | text | severity | cause | action |\n|---|---|---|---|---|\n";
  constexpr const char* kSeverities[] = {"none", "message", "warning", "fault"};
  for (const PlcAlarm& a : plc_alarms())
    out += fmt::format("| {} | {} | {} {} | {} | {} |\n", a.number, a.text, static_cast<unsigned>(a.severity),
                       kSeverities[static_cast<std::size_t>(a.severity)], a.cause, a.action);
}

}  // namespace

bool is_plc_command(std::uint16_t number) {
  return std::ranges::any_of(kCommands, [&](const Number& n) { return n.value == number; });
}

std::string plc_map_markdown() {
  std::string out = fmt::format("### The PLC writes: holding registers {} to {} ({} to {}), one FC16\n\n",
                                kPlcWriteBase, kPlcWriteBase + kPlcWriteWords - 1, 40001 + kPlcWriteBase,
                                40000 + kPlcWriteBase + kPlcWriteWords);
  add_registers(out, plc_write_registers(), kPlcWriteBase, kPlcWriteWords);
  out += fmt::format("\n### The PLC reads: holding registers {} to {} ({} to {}), one FC3\n\n", kPlcReadBase,
                     kPlcReadBase + kPlcReadWords - 1, 40001 + kPlcReadBase,
                     40000 + kPlcReadBase + kPlcReadWords);
  add_registers(out, plc_read_registers(), kPlcReadBase, kPlcReadWords);
  add_numbers(out, "Commands", kCommands);
  add_numbers(out, "Command results", kResults);
  out += "\n### PackML states (ISA-TR88)\n\n| number | state |\n|---|---|\n";
  for (std::size_t i = 0; i < std::size(kStates); ++i) out += fmt::format("| {} | {} |\n", i, kStates[i]);
  add_numbers(out, "PackML modes (ISA-TR88)", kModes);
  add_alarms(out);
  return out;
}

}  // namespace weldcell::wire
