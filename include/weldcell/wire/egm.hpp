// EGM datagrams <-> structs, RobotWare 6.07 to 7.16. Pure; real-time safe once made: messages are reused and
// their memory is taken by the constructor.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

namespace weldcell::wire {

enum class MotorState : std::uint8_t { Undefined = 0, On = 1, Off = 2 };
enum class MciState : std::uint8_t { Undefined = 0, Error = 1, Stopped = 2, Running = 3 };
enum class RapidState : std::uint8_t { Undefined = 0, Stopped = 1, Running = 2 };

/// What one EgmRobot message says. Degrees and millimetres as on the wire.
struct EgmFeedback {
  std::uint32_t seqno = 0;
  std::uint32_t tm_ms = 0;              ///< controller's clock at sending; wraps
  std::array<double, 6> joints_deg{};   ///< measured
  std::array<double, 6> planned_deg{};  ///< controller's reference; equals joints_deg when absent
  std::int64_t time_us = -1;            ///< measurement instant, controller's uptime clock; -1 when absent
  std::array<double, 3> position_mm{};  ///< measured TCP of the active tool; zeros when absent
  std::array<double, 4> orientation{1, 0, 0, 0};  ///< w x y z
  MotorState motors = MotorState::Undefined;
  MciState mci = MciState::Undefined;
  RapidState rapid = RapidState::Undefined;
  bool converged = false;
  double utilization_percent = 0;
};

/// One reply in joint mode with speed reference.
struct EgmCommand {
  std::uint32_t seqno = 0;
  std::uint32_t tm_ms = 0;
  std::array<double, 6> joints_deg{};
  std::array<double, 6> speed_deg_s{};
};

enum class EgmDecode : std::uint8_t {
  Ok,
  TooLong,      ///< more than kEgmMaxBytes; not looked at
  NotProtobuf,  ///< no EgmRobot message, or a required field is missing
  NoHeader,     ///< header, seqno or tm is missing
  NotData,      ///< the message type is not DATA: not from a controller
  NoJoints,     ///< measured joints are not six, or planned joints are neither absent nor six
  NotFinite     ///< a number used by the daemon is infinite, NaN or (clock) beyond 2^53 us
};
const char* to_string(EgmDecode);

/// Largest datagram either side may send; longer ones are refused before decoding.
inline constexpr std::size_t kEgmMaxBytes = 1400;

/// Decoder and encoder of the daemon's side. Not thread-safe: one per thread.
class EgmCodec {
 public:
  EgmCodec();
  ~EgmCodec();
  EgmCodec(const EgmCodec&) = delete;
  EgmCodec& operator=(const EgmCodec&) = delete;

  /// Reads one EgmRobot message of either RobotWare; `out` is untouched unless the answer is Ok.
  EgmDecode decode(std::span<const std::byte> datagram, EgmFeedback& out) noexcept;
  /// Writes one EgmSensor CORRECTION message; returns its size, 0 when it does not fit.
  std::size_t encode(const EgmCommand& command, std::span<std::byte> out) noexcept;

 private:
  struct Messages;
  std::unique_ptr<Messages> messages_;
};

}  // namespace weldcell::wire
