// The Modbus register map: one table that makes the server, docs/PLC.md, the simulated PLC and the
// conformance test. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace weldcell::wire {

enum class WordOrder : std::uint8_t { Abcd, Cdab };

/// PackML states and commands (ISA-TR88 numbers).
enum class PackState : std::uint16_t {
  Undefined = 0,
  Clearing = 1,
  Stopped = 2,
  Starting = 3,
  Idle = 4,
  Suspended = 5,
  Execute = 6,
  Stopping = 7,
  Aborting = 8,
  Aborted = 9,
  Holding = 10,
  Held = 11,
  Unholding = 12,
  Suspending = 13,
  Unsuspending = 14,
  Resetting = 15,
  Completing = 16,
  Complete = 17
};

/// PackML unit modes.
enum class PackMode : std::uint16_t { Invalid = 0, Production = 1, Maintenance = 2, Manual = 3 };

/// Commands of the PLC: 1 to 9 are PackML's CntrlCmd (ISA-TR88), from 20 on this cell's own. A command counts
/// once, when command_sequence changes.
enum class PlcCommand : std::uint16_t {
  None = 0,
  Reset = 1,
  Start = 2,
  Stop = 3,
  Hold = 4,
  Unhold = 5,
  Suspend = 6,    ///< always refused: the cell has no state for it
  Unsuspend = 7,  ///< always refused
  Abort = 8,
  Clear = 9,
  Arm = 20,      ///< a person allows motion; needed at every start and after every fault
  Confirm = 21,  ///< the worker has placed what the projector shows
  Resume = 22,   ///< go on with an interrupted job at its named step
  Select = 23    ///< the job named by job_number comes next; 0 takes the choice back
};

/// What became of a command: register command_result.
enum class PlcResult : std::uint16_t {
  Done = 0,
  Refused = 1,  ///< not in this state
  Unknown = 2,
  NotArmed = 3,
  LinkMissing = 4,  ///< robot controller, laser or the PLC's own heartbeat
  OtherJob = 5      ///< Start names another job than the one that stands ready
};

/// How bad an alarm is: register fault_severity.
enum class PlcSeverity : std::uint16_t { None = 0, Message = 1, Warning = 2, Fault = 3 };

/// One row of the alarm list. The number is register fault_code.
struct PlcAlarm {
  std::uint16_t number;
  const char* text;
  PlcSeverity severity;
  const char* cause;   ///< what was seen
  const char* action;  ///< what a person does
};
std::span<const PlcAlarm> plc_alarms();
/// The row of a number; nullptr when the list has none.
const PlcAlarm* plc_alarm(std::uint16_t number);
/// Alarms that are a state of the job and no fault in it.
inline constexpr std::uint16_t kAlarmInterrupted = 61;
inline constexpr std::uint16_t kAlarmJobFailed = 70;
inline constexpr std::uint16_t kAlarmLatency = 71;

enum class PlcType : std::uint8_t { Word, Long, Real };

struct PlcRegister {
  const char* name;
  std::uint16_t offset;  ///< first word inside its block
  PlcType type;          ///< Long (signed 32 bit) and Real take two words
  const char* unit;
  const char* meaning;
};

/// Holding registers: the PLC writes [0, kPlcWriteWords), the cell writes [100, 100 + kPlcReadWords).
inline constexpr std::uint16_t kPlcWriteBase = 0;
inline constexpr std::uint16_t kPlcWriteWords = 10;
inline constexpr std::uint16_t kPlcReadBase = 100;
inline constexpr std::uint16_t kPlcReadWords = 40;
inline constexpr std::uint16_t kPlcMapVersion = 2;  ///< +1 whenever a register moves or changes its meaning
inline constexpr std::uint16_t kPlcTestWord = 0x1234;
inline constexpr float kPlcTestReal = 123.456F;

std::span<const PlcRegister> plc_write_registers();
std::span<const PlcRegister> plc_read_registers();

/// What the PLC says, decoded.
struct PlcOrder {
  std::uint16_t heartbeat = 0;
  std::uint16_t command_sequence = 0;
  PlcCommand command = PlcCommand::None;
  std::int32_t job_number = 0;
};

/// What the cell says to the PLC.
struct PlcStatus {
  std::uint16_t heartbeat = 0;
  std::uint16_t command_ack = 0;     ///< echo of the sequence number taken
  std::uint16_t command_result = 0;  ///< PlcResult
  PackState state = PackState::Undefined;
  PackMode mode = PackMode::Production;
  std::uint16_t phase = 0;  ///< number of the job state, see docs/PLC.md
  std::uint16_t armed = 0;
  std::uint16_t guide_step = 0;    ///< 1-based; 0 = no guidance
  std::uint16_t guide_member = 0;  ///< number of the member to place
  std::uint16_t fault_code = 0;
  std::int32_t fault_detail = 0;  ///< phase in which the fault came
  std::int32_t job_number = 0;
  std::uint16_t progress_percent = 0;
  std::int32_t x_um = 0, y_um = 0, theta_mdeg = 0;
  float worst_weld_margin_mm = 0;  ///< tolerance - bound of the worst weld
  std::uint16_t seams_done = 0;
  PlcSeverity fault_severity = PlcSeverity::None;
  std::uint16_t jobs_waiting = 0;
  std::int32_t selected_job = 0;
};

PlcOrder decode_plc_order(std::span<const std::uint16_t, kPlcWriteWords> words, WordOrder order);
std::array<std::uint16_t, kPlcReadWords> encode_plc_status(const PlcStatus& status, WordOrder order);
/// The PLC's side of the two, for the simulated PLC and the conformance test.
std::array<std::uint16_t, kPlcWriteWords> encode_plc_order(const PlcOrder& order, WordOrder words);
PlcStatus decode_plc_status(std::span<const std::uint16_t, kPlcReadWords> words, WordOrder order);

/// The order in which the test REAL reads 123.456; empty when it does in neither or the test word is not
/// there.
std::optional<WordOrder> find_word_order(std::span<const std::uint16_t, kPlcReadWords> words);

/// Whether the number is a command at all, whatever the cell makes of it.
bool is_plc_command(std::uint16_t number);

/// The register, command, state and alarm tables of docs/PLC.md. A unit test holds the page to it.
std::string plc_map_markdown();

}  // namespace weldcell::wire
