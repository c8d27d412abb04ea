// One EGM cycle: datagram in, reply out. Follows a MotionPlan on the controller's clock, limits every reference, ramps
// to rest when told or when in doubt. Real-time safe: no allocation, lock, log or exception; it counts.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <span>

#include "weldcell/base/time.hpp"
#include "weldcell/cell/cell_setup.hpp"
#include "weldcell/plan/motion_plan.hpp"
#include "weldcell/wire/egm.hpp"

namespace weldcell::robot {

enum class EgmPhase : std::uint8_t {
  Waiting,    ///< no frame yet, or the session ended: nothing is commanded but the measured position
  Holding,    ///< holds the last reference at zero speed
  Following,  ///< streams a plan
  Stopping    ///< ramps down within the limits
};

enum class EgmRefusal : std::uint8_t {
  None, NotAtStart, NotRunning, AlreadyFollowing, Disarmed
};
const char* to_string(EgmRefusal);

/// What one cycle did; crosses to the cell thread beside the raw bytes. Trivially copyable.
struct EgmReport {
  EgmPhase phase = EgmPhase::Waiting;
  EgmRefusal refusal = EgmRefusal::None;  ///< why the last plan offered was not begun
  std::uint64_t plan_id = 0;         ///< being followed, or last followed
  double plan_time_s = 0;
  bool plan_done = false;            ///< reached its end (not stopped before)
  std::uint32_t session = 0;         ///< +1 at every session begin
  std::uint32_t limited = 0;         ///< references that a limit cut
  std::uint32_t malformed = 0;       ///< datagrams refused
  std::uint32_t stale = 0;           ///< frames older than one already answered
};

class EgmSession {
 public:
  explicit EgmSession(const cell::CellSetup& cell);

  /// Handles one datagram and writes the reply. Returns its size; 0 = no answer (malformed, stale).
  std::size_t on_datagram(std::span<const std::byte> datagram, HostTime arrival, std::span<std::byte> reply) noexcept;

  /// Begins the plan at the next frame if armed, at rest, RUNNING and its first sample is where the robot is
  /// (0.2 deg); else report().refusal tells why. The plan must outlive its use; the caller owns it.
  void offer(const plan::MotionPlan* plan) noexcept;
  /// From any thread: ramp to rest in the same cycle, drop the plan, stay so until the next offer.
  void request_stop() noexcept { stop_.store(true, std::memory_order_release); }
  /// From any thread: no plan is followed while disarmed; disarming ramps to rest.
  void set_armed(bool armed) noexcept { armed_.store(armed, std::memory_order_release); }

  const EgmReport& report() const { return report_; }
  const wire::EgmFeedback& feedback() const { return feedback_; }

 private:
  struct Limits {
    std::array<double, 6> lower_deg, upper_deg, speed_deg_s, acceleration_deg_s2;
  };
  void begin_session(const wire::EgmFeedback& f) noexcept;
  void follow(double dt_s) noexcept;
  void limit(double dt_s) noexcept;

  Limits limits_;
  wire::EgmCodec codec_;
  wire::EgmFeedback feedback_;
  EgmReport report_;
  const plan::MotionPlan* plan_ = nullptr;
  const plan::MotionPlan* offered_ = nullptr;
  std::atomic<bool> stop_{false};
  std::atomic<bool> armed_{false};
  std::array<double, 6> reference_deg_{};
  std::array<double, 6> reference_speed_deg_s_{};
  std::uint32_t last_seqno_ = 0, last_tm_ms_ = 0, reply_seqno_ = 0;
  std::int64_t last_time_us_ = -1;
  HostTime last_arrival_;
  bool in_session_ = false;
};

}  // namespace weldcell::robot
