// One EGM cycle: datagram in, reply out. Follows a MotionPlan on the controller's clock, limits every
// reference, ramps to rest when told or when in doubt. Real-time safe: no allocation, lock, log or exception;
// it counts.
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
  None,
  NotAtStart,        ///< the robot or its held reference is farther than 0.2 deg from the first sample; or no
                     ///< sample
  NotRunning,        ///< motors off, motion control not running or RAPID stopped
  AlreadyFollowing,  ///< another plan is being followed or ramped down
  Disarmed,
  Stopped  ///< request_stop() came between the offer and the next frame
};
const char* to_string(EgmRefusal);

/// What one cycle did; crosses to the cell thread beside the raw bytes. Trivially copyable.
struct EgmReport {
  EgmPhase phase = EgmPhase::Waiting;
  EgmRefusal refusal = EgmRefusal::None;  ///< why the last plan offered was not begun
  std::uint64_t plan_id = 0;              ///< being followed, or last followed
  double plan_time_s = 0;
  bool plan_done = false;       ///< reached its end (not stopped before); false again when another begins
  std::uint32_t session = 0;    ///< +1 at every session begin
  std::uint32_t limited = 0;    ///< references (one axis in one cycle) that a limit cut
  std::uint32_t malformed = 0;  ///< datagrams refused
  std::uint32_t stale = 0;      ///< frames older than one already answered
};

/// A session begins with the first frame, when the controller's count or clock goes back, or after 0.5 s of
/// silence: the reference is then where the robot is, and whatever was followed is dropped. A frame that is
/// older than one already answered gets no answer. While the controller is not running EGM the reply repeats
/// the measured joints.
///
/// Plan time advances by the controller's clock (feedBack.time, tm where that is absent), also across lost
/// frames; after more than 0.1 s without a frame the motion ramps down instead of catching up. Every
/// reference stays inside the joint range less its margin, the speed, the acceleration and the jerk of the
/// cell's limits (a stop may use four times the jerk; where they exclude each other the first named wins);
/// one that had to be cut is counted, and a reference that falls 0.5 deg behind its plan ramps down. The ramp
/// slows the plan's own time, so that it stays on the path; only what is off its plan goes straight on in
/// joint space.
///
/// The speed sent with a reference is the plan's a little later, by what the controller's hold of one cycle
/// and its low-pass filter (egm.low_pass_hz) delay it: without that lead every bend would be cut.
class EgmSession {
 public:
  /// The cell must state positive joint speeds and accelerations.
  explicit EgmSession(const cell::CellSetup& cell);

  /// Handles one datagram and writes the reply. Returns its size; 0 = no answer (malformed, stale).
  std::size_t on_datagram(std::span<const std::byte> datagram, HostTime arrival,
                          std::span<std::byte> reply) noexcept;

  /// No speed is commanded: nothing is lost when the next frame gets no answer.
  bool at_rest() const noexcept {
    return report_.phase == EgmPhase::Waiting || report_.phase == EgmPhase::Holding;
  }
  /// How far ahead of its reference the speed is taken from the plan.
  double speed_lead_s() const noexcept { return speed_lead_s_; }

  /// Begins the plan at the next frame if armed, at rest, running and its first sample is where the robot is
  /// (0.2 deg); else report().refusal tells why. What is left of the 0.2 deg fades out over the first 0.5 s.
  /// Call on the thread that calls on_datagram(). The caller owns the plan and keeps it while uses() says so.
  void offer(const plan::MotionPlan* plan) noexcept;
  /// True while the session may still read this plan: offered, followed, or ramping down along it. From any
  /// thread.
  bool uses(const plan::MotionPlan* plan) const noexcept {
    return plan != nullptr && (plan == plan_.load(std::memory_order_acquire) ||
                               plan == offered_.load(std::memory_order_acquire));
  }
  /// From any thread: ramp to rest in the same cycle, drop the plan, stay so until the next offer.
  void request_stop() noexcept { stop_.store(true, std::memory_order_release); }
  /// From any thread: no plan is followed while disarmed; disarming ramps to rest.
  void set_armed(bool armed) noexcept { armed_.store(armed, std::memory_order_release); }

  const EgmReport& report() const { return report_; }
  const wire::EgmFeedback& feedback() const { return feedback_; }

 private:
  using Axes = std::array<double, 6>;
  struct Limits {
    Axes lower_deg, upper_deg, speed_deg_s, acceleration_deg_s2, jerk_deg_s3;
  };
  enum class Arrival : std::uint8_t { Next, NewSession, Stale };
  /// A place of the way with its first two derivatives by the plan's time.
  struct WayPoint {
    Axes place_deg, speed_deg_s, bend_deg_s2;
  };

  Arrival classify(const wire::EgmFeedback& f, HostTime arrival) const noexcept;
  void begin_session() noexcept;
  void step(double dt_s) noexcept;
  double clock_step_s(const wire::EgmFeedback& f) const noexcept;
  void hold_measured() noexcept;
  /// True when the offered plan begins with this frame.
  bool take_offer() noexcept;
  EgmRefusal reason_to_refuse(const plan::MotionPlan& plan, bool stopped) const noexcept;
  void follow(double dt_s) noexcept;
  void brake(bool on_path) noexcept;
  void ramp_down(double dt_s) noexcept;
  void ramp_straight(double dt_s) noexcept;
  void come_to_rest() noexcept;
  void drop_plan(EgmPhase next) noexcept;
  /// The plan with what is left of the offset at its start.
  WayPoint way_at(const plan::MotionPlan& plan, double time_s) const noexcept;
  /// Lowers the rate of the plan's time as fast as the limits allow; returns its mean over the cycle.
  double slow_down(const WayPoint& way, double dt_s) noexcept;
  /// Moves the reference to the target, within the limits; true when it is there.
  bool track(const Axes& target_deg, const Axes& speed_deg_s, double dt_s) noexcept;
  /// The mean speed of this cycle that the limits allow for an axis that wants `speed`; the jerk's limit as a
  /// share of the cell's.
  double allowed(std::size_t axis, double speed_deg_s, double dt_s, double jerk_share) noexcept;

  Limits limits_;
  double speed_lead_s_ = 0;
  wire::EgmCodec codec_;
  wire::EgmFeedback feedback_;
  EgmReport report_;
  std::atomic<const plan::MotionPlan*> plan_{nullptr};
  std::atomic<const plan::MotionPlan*> offered_{nullptr};
  std::atomic<bool> stop_{false};
  std::atomic<bool> armed_{false};
  bool stopped_ = false;             ///< the stop bit as taken in this cycle
  Axes reference_deg_{};             ///< as sent
  Axes reference_speed_deg_s_{};     ///< as sent
  Axes step_speed_deg_s_{};          ///< mean speed of the reference between the last two frames
  Axes step_acceleration_deg_s2_{};  ///< and its change
  Axes target_deg_{};      ///< the way's point of the last frame; the reference unless a limit cut it
  Axes offset_deg_{};      ///< held reference less first sample when the plan began
  Axes straight_deg_s_{};  ///< direction of a ramp that is off its plan
  double rate_ = 1, rate_change_ = 0;  ///< of the way's time while ramping down
  double last_dt_s_ = 0, last_spacing_s_ = 0;
  std::uint32_t last_seqno_ = 0, last_tm_ms_ = 0, reply_seqno_ = 0;
  std::int64_t last_time_us_ = -1;
  HostTime last_arrival_;
  bool in_session_ = false;
};

}  // namespace weldcell::robot
