#include "weldcell/app/egm_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace weldcell::app {

std::uint64_t EgmWatch::Counted::gain(std::uint32_t now) {
  const std::uint64_t out = known ? static_cast<std::uint32_t>(now - last) : 0;
  last = now;
  known = true;
  return out;
}

void EgmWatch::on(const job::EgmCycle& cycle) {
  figures_.limited += limited_.gain(cycle.report.limited);
  figures_.stale += stale_.gain(cycle.report.stale);
  figures_.malformed += malformed_.gain(cycle.report.malformed);
  wire::EgmFeedback f;
  if (codec_->decode(cycle.datagram, f) != wire::EgmDecode::Ok) return;
  ++figures_.frames;
  figures_.utilization_percent = f.utilization_percent;
  figures_.motors = f.motors;
  figures_.mci = f.mci;
  figures_.rapid = f.rapid;
  figures_.converged = f.converged;
  if (cycle.report.phase == robot::EgmPhase::Following) {
    figures_.peak_percent = std::max(figures_.peak_percent, f.utilization_percent);
    if (f.utilization_percent > 100) ++figures_.overloaded;
  }
  warn(f, cycle.report);
}

void EgmWatch::warn(const wire::EgmFeedback& now, const robot::EgmReport& report) {
  const bool following = report.phase == robot::EgmPhase::Following;
  if (following && now.utilization_percent > 100 && overload_told_ != report.plan_id) {
    overload_told_ = report.plan_id;
    warnings_.push_back(fmt::format(
        "EGM: utilization {:.0f} %: the controller cuts the references, the arm leaves the planned path; "
        "lower "
        "inspection.speed_mm_s or robot.limits.joint_speed_fraction, or raise egm.max_speed_deviation_deg_s",
        now.utilization_percent));
  }
  if (following && now.converged && convergence_told_ != report.plan_id) {
    convergence_told_ = report.plan_id;
    warnings_.push_back(
        "EGM: the controller reports convergence while a motion is followed: its bands are not those of "
        "WeldcellEgm, and EGM may end by itself; load WeldcellEgm anew");
  }
  if (now.mci == wire::MciState::Error && error_told_ != report.session) {
    error_told_ = report.session;
    warnings_.push_back(
        "EGM: the controller's motion control reports an error; its event log names it (41822: our replies "
        "did not reach it, 50xxx: joint range, singularity or load)");
  }
}

std::vector<std::string> EgmWatch::take_warnings() { return std::exchange(warnings_, {}); }

const char* to_string(wire::MotorState state) {
  switch (state) {
    case wire::MotorState::On:
      return "on";
    case wire::MotorState::Off:
      return "off";
    case wire::MotorState::Undefined:
      break;
  }
  return "undefined";
}

const char* to_string(wire::MciState state) {
  switch (state) {
    case wire::MciState::Error:
      return "error";
    case wire::MciState::Stopped:
      return "stopped";
    case wire::MciState::Running:
      return "running";
    case wire::MciState::Undefined:
      break;
  }
  return "undefined";
}

const char* to_string(wire::RapidState state) {
  switch (state) {
    case wire::RapidState::Stopped:
      return "stopped";
    case wire::RapidState::Running:
      return "running";
    case wire::RapidState::Undefined:
      break;
  }
  return "undefined";
}

}  // namespace weldcell::app
