#include <fmt/format.h>

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
    {static_cast<unsigned>(PlcCommand::Stop), "Stop", "ramp to rest and end the job as interrupted"},
    {static_cast<unsigned>(PlcCommand::Abort), "Abort", "ramp to rest and fault; needs Clear"},
    {static_cast<unsigned>(PlcCommand::Clear), "Clear", "acknowledge a fault: from Aborted to Stopped"},
    {static_cast<unsigned>(PlcCommand::Arm), "Arm",
     "a person allows motion; needed at every start and after every fault"},
    {static_cast<unsigned>(PlcCommand::Confirm), "Confirm", "the worker has placed what the projector shows"},
    {static_cast<unsigned>(PlcCommand::Resume), "Resume", "go on with an interrupted job at its named step"},
};

constexpr Number kResults[] = {
    {0, "done", "the command was taken"},
    {1, "refused", "not in this state"},
    {2, "unknown", "no such command"},
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

}  // namespace

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
  return out;
}

}  // namespace weldcell::wire
