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
constexpr double kSpeedSlack = 1.02, kAccelerationSlack = 1.1, kJerkSlack = 1.25;
/// In which a reference behind its plan closes up by a factor e: gentle against the jerk limit.
constexpr double kCloseUpS = 0.1;
/// A stop may change its acceleration this much faster than a plan: better the arm shakes than that it goes
/// on.
constexpr double kStopJerk = 4;
constexpr double kAnyJerk = 1e6;
constexpr double kOnTargetDeg = 1e-6;
/// An axis slower than this does not decide how fast the others may stop.
constexpr double kSlowAxisDegS = 0.02;

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
    limits_.jerk_deg_s3[i] = deg(cell.limits.joint_jerk[i]);
    WELDCELL_ASSERT(limits_.speed_deg_s[i] > 0 && limits_.acceleration_deg_s2[i] > 0 &&
                    limits_.jerk_deg_s3[i] > 0);
  }
  // The controller holds a speed for one cycle, half a cycle late on the mean, and filters it once a cycle.
  const double cycle_s = cell.egm.cycle_ms * 1e-3;
  const double kept = std::exp(-2 * kPi * cell.egm.low_pass_hz * cycle_s);
  speed_lead_s_ = cell.egm.low_pass_hz > 0 ? cycle_s / 2 + cycle_s * kept / (1 - kept) : 0;
}

void EgmSession::offer(const plan::MotionPlan* plan) noexcept {
  offered_.store(plan, std::memory_order_release);
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
  last_dt_s_ = last_spacing_s_ = 0;
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
  if (report_.phase == EgmPhase::Following && !may_move) brake(true);
  const bool begun = offered_.load(std::memory_order_relaxed) != nullptr && take_offer();
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
  step_acceleration_deg_s2_ = {};
}

void EgmSession::drop_plan(EgmPhase next) noexcept {
  plan_.store(nullptr, std::memory_order_release);
  report_.phase = next;
}

bool EgmSession::take_offer() noexcept {
  const plan::MotionPlan& plan = *offered_.load(std::memory_order_relaxed);
  report_.refusal = reason_to_refuse(plan, stopped_);
  // In this order, so that uses() never misses a plan on its way from one to the other.
  if (report_.refusal == EgmRefusal::None) plan_.store(&plan, std::memory_order_release);
  offered_.store(nullptr, std::memory_order_release);
  if (report_.refusal != EgmRefusal::None) return false;
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

EgmSession::WayPoint EgmSession::way_at(const plan::MotionPlan& plan, double time_s) const noexcept {
  const plan::MotionSample at = plan::sample_at(plan, time_s);
  const plan::MotionSample before = plan::sample_at(plan, time_s - plan.period_s / 2);
  const plan::MotionSample after = plan::sample_at(plan, time_s + plan.period_s / 2);
  const Fade faded = fade(time_s, plan.duration_s());
  WayPoint out{in_degrees(at.q), in_degrees(at.qd), {}};
  for (std::size_t i = 0; i < 6; ++i) {
    out.place_deg[i] += faded.left * offset_deg_[i];
    out.speed_deg_s[i] += faded.rate_per_s * offset_deg_[i];
    out.bend_deg_s2[i] = deg(after.qd[i] - before.qd[i]) / plan.period_s;
  }
  return out;
}

void EgmSession::follow(double dt_s) noexcept {
  const plan::MotionPlan& plan = *plan_.load(std::memory_order_relaxed);
  const double duration_s = plan.duration_s();
  report_.plan_time_s = std::min(report_.plan_time_s + dt_s, duration_s);
  const Axes target = way_at(plan, report_.plan_time_s).place_deg;
  if (!(farthest(target, target_deg_) < std::numeric_limits<double>::infinity())) {
    brake(false);
    ramp_down(dt_s);
    return;
  }
  const bool there = track(target, way_at(plan, report_.plan_time_s + speed_lead_s_).speed_deg_s, dt_s);
  if (there && report_.plan_time_s >= duration_s) {
    report_.plan_done = true;
    come_to_rest();
  } else if (farthest(target_deg_, reference_deg_) > kFarBehindDeg) {
    brake(false);
  }
}

/// Begins a ramp to rest: along the plan, or straight on where the reference is not on it.
void EgmSession::brake(bool on_path) noexcept {
  report_.phase = EgmPhase::Stopping;
  rate_ = 1;
  rate_change_ = 0;
  if (on_path) return;
  plan_.store(nullptr, std::memory_order_release);
  straight_deg_s_ = reference_speed_deg_s_;
}

void EgmSession::ramp_down(double dt_s) noexcept {
  const plan::MotionPlan* plan = plan_.load(std::memory_order_relaxed);
  if (plan == nullptr) {
    ramp_straight(dt_s);
    return;
  }
  const double mean_rate = slow_down(way_at(*plan, report_.plan_time_s), dt_s);
  report_.plan_time_s = std::min(report_.plan_time_s + mean_rate * dt_s, plan->duration_s());
  if (report_.plan_time_s >= plan->duration_s()) rate_ = 0;
  // The lead foresees the ramp, too.
  Axes speed = way_at(*plan, report_.plan_time_s + speed_lead_s_ * rate_).speed_deg_s;
  for (double& v : speed) v *= std::max(0.0, rate_ + rate_change_ * speed_lead_s_);
  track(way_at(*plan, report_.plan_time_s).place_deg, speed, dt_s);
  if (farthest(target_deg_, reference_deg_) > kFarBehindDeg) {
    brake(false);
    return;
  }
  if (rate_ > 0) return;
  for (const double v : step_speed_deg_s_) {
    if (std::abs(v) > kSlowAxisDegS) return;
  }
  target_deg_ = reference_deg_;
  come_to_rest();
}

/// All axes in step with constant deceleration: the reference is off its plan, so its own speed is all there
/// is.
void EgmSession::ramp_straight(double dt_s) noexcept {
  double rest_s = 0;
  for (std::size_t i = 0; i < 6; ++i)
    rest_s = std::max(rest_s, std::abs(straight_deg_s_[i]) / limits_.acceleration_deg_s2[i]);
  const double scale = rest_s > dt_s ? 1 - dt_s / rest_s : 0;
  const double moving_s = std::min(dt_s, rest_s);
  for (std::size_t i = 0; i < 6; ++i) {
    const double before = straight_deg_s_[i], after = before * scale;
    const double given = allowed(i, 0.5 * (before + after) * moving_s / dt_s, dt_s, kAnyJerk);
    step_speed_deg_s_[i] = given;
    reference_deg_[i] += given * dt_s;
    straight_deg_s_[i] = reference_speed_deg_s_[i] = std::abs(after) <= std::abs(given) ? after : given;
  }
  if (scale > 0) return;
  target_deg_ = reference_deg_;
  come_to_rest();
}

void EgmSession::come_to_rest() noexcept {
  reference_speed_deg_s_ = {};
  step_speed_deg_s_ = {};
  step_acceleration_deg_s2_ = {};
  drop_plan(EgmPhase::Holding);
}

double EgmSession::slow_down(const WayPoint& way, double dt_s) noexcept {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const double before = rate_;
  double lowest = -kNone, highest = kNone, rate_jerk = kNone;
  for (std::size_t i = 0; i < 6; ++i) {
    const double v = way.speed_deg_s[i], bend = way.bend_deg_s2[i];
    const double jerk = limits_.jerk_deg_s3[i] * kStopJerk, most = limits_.acceleration_deg_s2[i];
    // Slower time also takes from what the way itself bends.
    if (std::abs(bend) * rate_ > 0.01 * jerk * dt_s)
      lowest = std::max(lowest, -jerk / (2 * std::abs(bend) * rate_));
    if (std::abs(v) < kSlowAxisDegS) continue;
    const double own = bend * rate_ * rate_, last = std::clamp(step_acceleration_deg_s2_[i], -most, most);
    const double a = (std::max(-most, last - jerk * dt_s) - own) / v;
    const double b = (std::min(most, last + jerk * dt_s) - own) / v;
    lowest = std::max(lowest, std::min(a, b));
    highest = std::min(highest, std::max(a, b));
    rate_jerk = std::min(rate_jerk, jerk / std::abs(v));
  }
  if (rate_jerk == kNone) {
    rate_ = rate_change_ = 0;
    return 0;
  }
  double change = lowest <= highest ? lowest : (lowest + highest) / 2;
  // No more than can be taken back before time stands.
  const double half = rate_jerk * dt_s / 2;
  change = std::max(change, half - std::sqrt(half * half + 2 * rate_jerk * rate_));
  rate_change_ = std::min(change, 0.0);
  rate_ = rate_ + rate_change_ * dt_s;
  if (rate_ < rate_jerk * dt_s * dt_s) rate_ = 0;
  if (rate_ <= 0) rate_ = rate_change_ = 0;
  return (before + rate_) / 2;
}

bool EgmSession::track(const Axes& target_deg, const Axes& speed_deg_s, double dt_s) noexcept {
  bool there = true;
  const double jerk = report_.phase == EgmPhase::Stopping ? kStopJerk * kJerkSlack : kJerkSlack;
  const double spacing_s = 0.5 * (dt_s + (last_dt_s_ > 0 ? last_dt_s_ : dt_s));
  for (std::size_t i = 0; i < 6; ++i) {
    // Behind its plan after a cut, an axis closes up no faster than it can brake again.
    const double behind = target_deg_[i] - reference_deg_[i];
    const double closing =
        std::min(std::abs(behind) / kCloseUpS, std::sqrt(limits_.acceleration_deg_s2[i] * std::abs(behind)));
    const double wanted = (target_deg[i] - target_deg_[i]) / dt_s + std::copysign(closing, behind);
    const double given = allowed(i, wanted, dt_s, jerk);
    step_acceleration_deg_s2_[i] = (given - step_speed_deg_s_[i]) / spacing_s;
    step_speed_deg_s_[i] = given;
    reference_deg_[i] += given * dt_s;
    if (std::abs(reference_deg_[i] - target_deg[i]) < kOnTargetDeg) {
      const double fastest = limits_.speed_deg_s[i] * kSpeedSlack;
      reference_deg_[i] = target_deg[i];
      reference_speed_deg_s_[i] = std::clamp(speed_deg_s[i], -fastest, fastest);
    } else {
      reference_speed_deg_s_[i] = given;
      there = false;
    }
  }
  target_deg_ = target_deg;
  last_spacing_s_ = spacing_s;
  return there;
}

double EgmSession::allowed(std::size_t axis, double speed_deg_s, double dt_s, double jerk_share) noexcept {
  const double most = limits_.acceleration_deg_s2[axis] * kAccelerationSlack;
  const double fastest = limits_.speed_deg_s[axis] * kSpeedSlack;
  // Mean speeds of two cycles are half of both cycles apart, and so are their changes.
  const double spacing_s = 0.5 * (dt_s + (last_dt_s_ > 0 ? last_dt_s_ : dt_s));
  const double apart_s = 0.5 * (spacing_s + (last_spacing_s_ > 0 ? last_spacing_s_ : spacing_s));
  const double bend = limits_.jerk_deg_s3[axis] * jerk_share * apart_s;
  const double last = step_acceleration_deg_s2_[axis];
  double change = (speed_deg_s - step_speed_deg_s_[axis]) / spacing_s;
  change = std::clamp(std::clamp(change, last - bend, last + bend), -most, most);
  double out = std::clamp(step_speed_deg_s_[axis] + change * spacing_s, -fastest, fastest);
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
