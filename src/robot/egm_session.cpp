#include "weldcell/robot/egm_session.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "weldcell/base/assert.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::robot {
namespace {

static_assert(std::is_trivially_copyable_v<EgmReport>);
static_assert(std::atomic<bool>::is_always_lock_free);

constexpr Nanoseconds kSilenceEndsSession = 500 * kMillisecond;
constexpr double kLongestCatchUpS = 0.1;
constexpr double kAtStartDeg = 0.2;
constexpr double kFadeS = 0.5;
constexpr double kFarBehindDeg = 0.5;
/// Frames this much older than the last one are late; what lies farther back is a controller that began anew.
constexpr std::int32_t kLateFrames = 250, kLateMs = 1000;
/// Room between the limits that plans keep and the ones enforced here, for interpolation and the fade-in.
constexpr double kSpeedSlack = 1.02, kAccelerationSlack = 1.1;

bool is_running(const wire::EgmFeedback& f) {
  // RAPID reports UNDEFINED for ever after some controller restarts, although it runs.
  return f.motors == wire::MotorState::On && f.mci == wire::MciState::Running &&
         f.rapid != wire::RapidState::Stopped;
}

/// Difference of two counts that wrap.
std::int32_t ahead(std::uint32_t now, std::uint32_t then) { return static_cast<std::int32_t>(now - then); }

/// Infinite when there is a NaN among them.
double farthest(const std::array<double, 6>& a, const std::array<double, 6>& b) {
  double out = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    const double d = std::abs(a[i] - b[i]);
    if (!(d <= out)) out = std::isnan(d) ? std::numeric_limits<double>::infinity() : d;
  }
  return out;
}

std::array<double, 6> in_degrees(const kinematics::Joints& q) {
  std::array<double, 6> out{};
  for (std::size_t i = 0; i < 6; ++i) out[i] = deg(q[i]);
  return out;
}

/// Part of the first offset that is left after a time, and how fast it goes: 1 to 0, at rest at both ends, as
/// a quintic.
struct Fade {
  double left, rate_per_s;
};
Fade fade(double time_s, double duration_s) {
  const double over = std::min(kFadeS, duration_s);
  if (!(time_s < over)) return {0, 0};
  const double u = std::max(0.0, time_s) / over;
  return {1 - u * u * u * (10 + u * (6 * u - 15)), -30 * u * u * (1 - u) * (1 - u) / over};
}

}  // namespace

const char* to_string(EgmRefusal refusal) {
  switch (refusal) {
    case EgmRefusal::None:
      return "none";
    case EgmRefusal::NotAtStart:
      return "the robot is not at the motion's first point";
    case EgmRefusal::NotRunning:
      return "the controller is not running EGM";
    case EgmRefusal::AlreadyFollowing:
      return "another motion is not over yet";
    case EgmRefusal::Disarmed:
      return "the cell is not armed";
    case EgmRefusal::Stopped:
      return "a stop was requested";
  }
  return "unknown";
}

EgmSession::EgmSession(const cell::CellSetup& cell) {
  for (std::size_t i = 0; i < 6; ++i) {
    limits_.lower_deg[i] = deg(cell.arm.lower[i] + cell.limits.limit_margin_rad);
    limits_.upper_deg[i] = deg(cell.arm.upper[i] - cell.limits.limit_margin_rad);
    limits_.speed_deg_s[i] = deg(cell.arm.max_speed[i]) * cell.limits.joint_speed_fraction;
    limits_.acceleration_deg_s2[i] = deg(cell.limits.joint_acceleration[i]);
    WELDCELL_ASSERT(limits_.speed_deg_s[i] > 0 && limits_.acceleration_deg_s2[i] > 0);
  }
}

void EgmSession::offer(const plan::MotionPlan* plan) noexcept {
  offered_ = plan;
  report_.refusal = EgmRefusal::None;
}

std::size_t EgmSession::on_datagram(std::span<const std::byte> datagram, HostTime arrival,
                                    std::span<std::byte> reply) noexcept {
  wire::EgmFeedback f;
  if (codec_.decode(datagram, f) != wire::EgmDecode::Ok) {
    ++report_.malformed;
    return 0;
  }
  const Arrival kind = classify(f, arrival);
  if (kind == Arrival::Stale) {
    ++report_.stale;
    return 0;
  }
  const double dt_s = kind == Arrival::Next ? clock_step_s(f) : 0;
  feedback_ = f;
  last_seqno_ = f.seqno;
  last_tm_ms_ = f.tm_ms;
  last_time_us_ = f.time_us;
  last_arrival_ = arrival;
  if (kind == Arrival::NewSession) begin_session();
  step(dt_s);
  const wire::EgmCommand command{reply_seqno_++, static_cast<std::uint32_t>(arrival.ns / kMillisecond),
                                 reference_deg_, reference_speed_deg_s_};
  return codec_.encode(command, reply);
}

EgmSession::Arrival EgmSession::classify(const wire::EgmFeedback& f, HostTime arrival) const noexcept {
  if (!in_session_ || arrival - last_arrival_ > kSilenceEndsSession) return Arrival::NewSession;
  const std::int32_t frames = ahead(f.seqno, last_seqno_), ms = ahead(f.tm_ms, last_tm_ms_);
  if (frames > 0) return ms >= 0 ? Arrival::Next : Arrival::NewSession;
  const bool late = ms <= 0 && ms > -kLateMs && frames > -kLateFrames;
  return late ? Arrival::Stale : Arrival::NewSession;
}

double EgmSession::clock_step_s(const wire::EgmFeedback& f) const noexcept {
  const double by_tm_s = 1e-3 * ahead(f.tm_ms, last_tm_ms_);
  if (f.time_us < 0 || last_time_us_ < 0 || f.time_us <= last_time_us_) return by_tm_s;
  return 1e-6 * static_cast<double>(f.time_us - last_time_us_);
}

void EgmSession::begin_session() noexcept {
  in_session_ = true;
  ++report_.session;
  reply_seqno_ = 0;
  last_dt_s_ = 0;
  drop_plan(EgmPhase::Waiting);
  hold_measured();
}

/// One cycle: stop and arm bits, controller states, offer, then the motion.
void EgmSession::step(double dt_s) noexcept {
  stopped_ = stop_.exchange(false, std::memory_order_acq_rel);
  if (!is_running(feedback_)) {
    drop_plan(EgmPhase::Waiting);
    hold_measured();
  } else if (report_.phase == EgmPhase::Waiting) {
    hold_measured();
    report_.phase = EgmPhase::Holding;
  }
  const bool may_move = armed_.load(std::memory_order_acquire) && !stopped_ && dt_s <= kLongestCatchUpS;
  if (report_.phase == EgmPhase::Following && !may_move) drop_plan(EgmPhase::Stopping);
  const bool begun = offered_ != nullptr && take_offer();
  // A ramp after a gap goes on as if no frame had been lost: the robot has stood at the last reference
  // meanwhile.
  const double motion_dt_s = dt_s <= kLongestCatchUpS ? dt_s : last_dt_s_;
  if (motion_dt_s <= 0) return;
  // The first sample belongs to the frame at which the plan begins.
  if (report_.phase == EgmPhase::Following && !begun) {
    follow(motion_dt_s);
  } else if (report_.phase == EgmPhase::Stopping) {
    ramp_down(motion_dt_s);
  }
  last_dt_s_ = motion_dt_s;
}

void EgmSession::hold_measured() noexcept {
  reference_deg_ = feedback_.joints_deg;
  target_deg_ = reference_deg_;
  reference_speed_deg_s_ = {};
  step_speed_deg_s_ = {};
}

void EgmSession::drop_plan(EgmPhase next) noexcept {
  plan_ = nullptr;
  report_.phase = next;
}

bool EgmSession::take_offer() noexcept {
  const plan::MotionPlan& plan = *offered_;
  offered_ = nullptr;
  report_.refusal = reason_to_refuse(plan, stopped_);
  if (report_.refusal != EgmRefusal::None) return false;
  plan_ = &plan;
  report_.phase = EgmPhase::Following;
  report_.plan_id = plan.id;
  report_.plan_time_s = 0;
  report_.plan_done = false;
  const Axes start = in_degrees(plan.samples.front().q);
  for (std::size_t i = 0; i < 6; ++i) offset_deg_[i] = reference_deg_[i] - start[i];
  target_deg_ = reference_deg_;
  return true;
}

EgmRefusal EgmSession::reason_to_refuse(const plan::MotionPlan& plan, bool stopped) const noexcept {
  if (stopped) return EgmRefusal::Stopped;
  if (!is_running(feedback_)) return EgmRefusal::NotRunning;
  if (report_.phase != EgmPhase::Holding) return EgmRefusal::AlreadyFollowing;
  if (!armed_.load(std::memory_order_acquire)) return EgmRefusal::Disarmed;
  if (plan.samples.empty()) return EgmRefusal::NotAtStart;
  const Axes start = in_degrees(plan.samples.front().q);
  const double off = std::max(farthest(start, feedback_.joints_deg), farthest(start, reference_deg_));
  return off <= kAtStartDeg ? EgmRefusal::None : EgmRefusal::NotAtStart;
}

void EgmSession::follow(double dt_s) noexcept {
  const double duration_s = plan_->duration_s();
  report_.plan_time_s = std::min(report_.plan_time_s + dt_s, duration_s);
  const plan::MotionSample sample = plan::sample_at(*plan_, report_.plan_time_s);
  const Fade faded = fade(report_.plan_time_s, duration_s);
  Axes target = in_degrees(sample.q), speed = in_degrees(sample.qd);
  if (!(farthest(target, target_deg_) < std::numeric_limits<double>::infinity())) {
    drop_plan(EgmPhase::Stopping);
    ramp_down(dt_s);
    return;
  }
  bool reached = report_.plan_time_s >= duration_s;
  for (std::size_t i = 0; i < 6; ++i) {
    target[i] += faded.left * offset_deg_[i];
    speed[i] += faded.rate_per_s * offset_deg_[i];
    // Behind its plan after a cut, an axis closes up no faster than it can brake again.
    const double behind = target_deg_[i] - reference_deg_[i];
    const double closing =
        std::min(std::abs(behind) / dt_s, std::sqrt(limits_.acceleration_deg_s2[i] * std::abs(behind)));
    const double wanted = (target[i] - target_deg_[i]) / dt_s + std::copysign(closing, behind);
    const double given = allowed(i, wanted, dt_s);
    step_speed_deg_s_[i] = given;
    reference_deg_[i] += given * dt_s;
    if (std::abs(reference_deg_[i] - target[i]) < 1e-9) {
      reference_deg_[i] = target[i];
      reference_speed_deg_s_[i] =
          std::clamp(speed[i], -limits_.speed_deg_s[i] * kSpeedSlack, limits_.speed_deg_s[i] * kSpeedSlack);
    } else {
      reference_speed_deg_s_[i] = given;
      reached = false;
    }
  }
  target_deg_ = target;
  if (reached) {
    reference_speed_deg_s_ = {};
    step_speed_deg_s_ = {};
    report_.plan_done = true;
    drop_plan(EgmPhase::Holding);
  } else if (farthest(target_deg_, reference_deg_) > kFarBehindDeg) {
    drop_plan(EgmPhase::Stopping);
  }
}

void EgmSession::ramp_down(double dt_s) noexcept {
  double rest_s = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    rest_s = std::max(rest_s, std::abs(reference_speed_deg_s_[i]) / limits_.acceleration_deg_s2[i]);
  }
  const double scale = rest_s > dt_s ? 1 - dt_s / rest_s : 0;
  const double moving_s = std::min(dt_s, rest_s);
  for (std::size_t i = 0; i < 6; ++i) {
    const double before = reference_speed_deg_s_[i], after = before * scale;
    const double given = allowed(i, 0.5 * (before + after) * moving_s / dt_s, dt_s);
    step_speed_deg_s_[i] = given;
    reference_deg_[i] += given * dt_s;
    reference_speed_deg_s_[i] = std::abs(after) <= std::abs(given) ? after : given;
  }
  if (scale > 0) return;
  reference_speed_deg_s_ = {};
  step_speed_deg_s_ = {};
  target_deg_ = reference_deg_;
  report_.phase = EgmPhase::Holding;
}

double EgmSession::allowed(std::size_t axis, double speed_deg_s, double dt_s) noexcept {
  const double acceleration = limits_.acceleration_deg_s2[axis] * kAccelerationSlack;
  const double fastest = limits_.speed_deg_s[axis] * kSpeedSlack;
  // Mean speeds of two cycles are half of both cycles apart.
  const double change = acceleration * 0.5 * (dt_s + (last_dt_s_ > 0 ? last_dt_s_ : dt_s));
  double out = std::clamp(speed_deg_s, -fastest, fastest);
  out = std::clamp(out, step_speed_deg_s_[axis] - change, step_speed_deg_s_[axis] + change);
  // Towards the end of the range no faster than it can brake, counting this cycle's own way.
  const auto brakeable = [&](double room_deg) {
    if (!(room_deg > 0)) return 0.0;
    const double half = 0.5 * limits_.acceleration_deg_s2[axis] * dt_s;
    return std::min(room_deg / dt_s,
                    std::sqrt(half * half + 2 * limits_.acceleration_deg_s2[axis] * room_deg) - half);
  };
  const double up = brakeable(limits_.upper_deg[axis] - reference_deg_[axis]);
  const double down = brakeable(reference_deg_[axis] - limits_.lower_deg[axis]);
  out = std::clamp(out, -down, up);
  if (!(std::abs(out - speed_deg_s) <= 1e-6)) ++report_.limited;
  return out;
}

}  // namespace weldcell::robot
