// What the PLC and the operator ask of the cell, what hinders it, and what the cell shows them.
#include <algorithm>
#include <cmath>

#include "weldcell/base/units.hpp"
#include "weldcell/job/cell.hpp"

namespace weldcell::job {

namespace {

std::int32_t rounded(double value) { return static_cast<std::int32_t>(std::lround(value)); }

wire::PackState pack_state(State state, FaultCode fault, bool cleared) {
  switch (state) {
    case State::Idle:
    case State::Importing:
    case State::Planning:
    case State::Ready:
      return wire::PackState::Idle;
    case State::Done:
      return wire::PackState::Complete;
    case State::Failed:
      return wire::PackState::Stopped;
    case State::Faulted:
      if (fault == FaultCode::Held) return wire::PackState::Held;
      if (fault == FaultCode::StoppedByPerson) return wire::PackState::Stopped;
      [[fallthrough]];
    case State::Interrupted:
      return cleared ? wire::PackState::Stopped : wire::PackState::Aborted;
    default:
      return wire::PackState::Execute;
  }
}

/// Empty for a number that is no command.
std::string order_name(wire::PlcCommand order) {
  using wire::PlcCommand;
  switch (order) {
    case PlcCommand::None:
      return "none";
    case PlcCommand::Reset:
      return "reset";
    case PlcCommand::Start:
      return "start";
    case PlcCommand::Stop:
      return "stop";
    case PlcCommand::Hold:
      return "hold";
    case PlcCommand::Unhold:
      return "unhold";
    case PlcCommand::Suspend:
      return "suspend";
    case PlcCommand::Unsuspend:
      return "unsuspend";
    case PlcCommand::Select:
      return "select";
    case PlcCommand::Abort:
      return "abort";
    case PlcCommand::Clear:
      return "clear";
    case PlcCommand::Arm:
      return "arm";
    case PlcCommand::Confirm:
      return "confirm";
    case PlcCommand::Resume:
      return "resume";
  }
  return {};
}

}  // namespace

wire::PlcResult Cell::command(wire::PlcCommand order, std::int32_t job_number, const std::string& who) {
  const std::string name = order_name(order);
  if (name.empty()) {
    refusal_ = "unknown command " + std::to_string(static_cast<int>(order)) + " from " + who;
    log(LogEvent::Level::Warning, refusal_);
    return wire::PlcResult::Unknown;
  }
  log(LogEvent::Level::Info, name + " from " + who);
  const Answer answer = obey(order, job_number, who);
  if (answer.result == wire::PlcResult::Done) return answer.result;
  refusal_ = name + " refused: " + answer.hindrance;
  log(LogEvent::Level::Warning, refusal_);
  return answer.result;
}

Cell::Answer Cell::obey(wire::PlcCommand order, std::int32_t job_number, const std::string& who) {
  using wire::PlcCommand;
  const Answer not_now{wire::PlcResult::Refused,
                       std::string("nothing waits for it in state ") + to_string(status_.state)};
  const auto outcome = [&](bool taken) { return taken ? Answer{} : not_now; };
  const bool stands = status_.state == State::Faulted || status_.state == State::Interrupted;
  switch (order) {
    case PlcCommand::None:
      return {};
    case PlcCommand::Clear:
      if (stands) cleared_ = true;
      return outcome(stands);
    case PlcCommand::Arm:
      cleared_ = true;
      set_armed(true);
      return {};
    case PlcCommand::Start:
    case PlcCommand::Resume:
    case PlcCommand::Unhold:
      return start_or_resume(order, job_number);
    case PlcCommand::Select:
      return select(job_number);
    case PlcCommand::Confirm:
      return outcome(fire(Event::Confirm));
    case PlcCommand::Reset:
      return outcome(fire(Event::Reset));
    case PlcCommand::Stop:
      if (!under_way(status_.state)) return not_now;
      fault(FaultCode::StoppedByPerson, "stop from " + who);
      return {};
    case PlcCommand::Hold:
      if (status_.plc.state != wire::PackState::Execute) return not_now;
      fault(FaultCode::Held, "hold from " + who);
      return {};
    case PlcCommand::Suspend:
    case PlcCommand::Unsuspend:
      return {wire::PlcResult::Refused, "the cell is never starved or blocked: use hold"};
    case PlcCommand::Abort:
      failure_ = "aborted by " + who;
      return outcome(fire(Event::Abort));
  }
  return not_now;
}

Cell::Answer Cell::start_or_resume(wire::PlcCommand order, std::int32_t job_number) {
  const bool start = order == wire::PlcCommand::Start;
  const bool held = status_.state == State::Faulted && status_.fault == FaultCode::Held;
  const bool waits = start ? status_.state == State::Ready
                     : order == wire::PlcCommand::Unhold
                         ? held
                         : status_.state == State::Faulted || status_.state == State::Interrupted;
  const Answer not_now{wire::PlcResult::Refused,
                       std::string("nothing waits for it in state ") + to_string(status_.state)};
  if (!waits) return not_now;
  if (start && job_number != 0 && job_number != shown_number(job_->order)) {
    return {wire::PlcResult::OtherJob, "job number " + std::to_string(shown_number(job_->order)) +
                                           " stands ready, not " + std::to_string(job_number) +
                                           ": select it first"};
  }
  if (Answer hindrance = start_hindrance(); hindrance.result != wire::PlcResult::Done) return hindrance;
  return fire(start ? Event::Start : Event::Resume) ? Answer{} : not_now;
}

Cell::Answer Cell::select(std::int32_t job_number) {
  const bool ready = status_.state == State::Ready;
  if (!ready && status_.state != State::Idle && !ended(status_.state))
    return {wire::PlcResult::Refused, std::string("a job is under way: ") + to_string(status_.state)};
  const bool stands_ready = ready && job_number == shown_number(job_->order);
  select_job(stands_ready ? 0 : job_number);
  if (ready && job_number != 0 && !stands_ready) fire(Event::PutBack);
  return {};
}

void Cell::select_job(std::int32_t job_number) {
  if (job_number == selected_job_) return;
  selected_job_ = job_number;
  out_.push_back(SelectJob{job_number});
}

std::int32_t Cell::shown_number(const JobOrder& order) { return order.number > 0 ? order.number : -1; }

Cell::Answer Cell::start_hindrance() const {
  using wire::PlcResult;
  const auto down = [&](Link link) { return !status_.links[static_cast<std::size_t>(link)]; };
  if (!status_.armed) return {PlcResult::NotArmed, "not armed: a person must arm the cell first"};
  if (down(Link::Rws)) return {PlcResult::LinkMissing, "the robot controller is not reachable"};
  if (down(Link::Laser))
    return {PlcResult::LinkMissing,
            "the laser is not connected" + (laser_trouble_.empty() ? "" : ": " + laser_trouble_)};
  if (plc_required_ && down(Link::Plc)) return {PlcResult::LinkMissing, "the PLC's heartbeat is missing"};
  return {};
}

void Cell::set_armed(bool armed) {
  status_.armed = armed;
  out_.push_back(SetArmed{armed});
}

void Cell::refresh_plc() {
  wire::PlcStatus& plc = status_.plc;
  plc.state = pack_state(status_.state, status_.fault, cleared_);
  plc.phase = static_cast<std::uint16_t>(status_.state);
  plc.armed = status_.armed ? 1 : 0;
  plc.guide_step = static_cast<std::uint16_t>(status_.guide_step);
  plc.guide_member = plc.guide_step;
  const bool faulted = status_.fault != FaultCode::None;
  plc.fault_code = faulted                               ? static_cast<std::uint16_t>(status_.fault)
                   : status_.state == State::Interrupted ? wire::kAlarmInterrupted
                   : status_.state == State::Failed      ? wire::kAlarmJobFailed
                   : latency_drifted_                    ? wire::kAlarmLatency
                                                         : std::uint16_t{0};
  plc.fault_detail = faulted ? static_cast<std::int32_t>(resume_state_) : 0;
  const wire::PlcAlarm* alarm = wire::plc_alarm(plc.fault_code);
  plc.fault_severity = alarm != nullptr ? alarm->severity : wire::PlcSeverity::None;
  plc.selected_job = selected_job_;
  plc.progress_percent = static_cast<std::uint16_t>(std::clamp(status_.progress, 0.0, 1.0) * 100);
  plc.seams_done = static_cast<std::uint16_t>(status_.seams_done);
  const bool waits = job_ && status_.state != State::Importing && status_.state != State::Planning &&
                     status_.state != State::Idle && status_.state != State::Failed;
  plc.job_number = waits ? shown_number(job_->order) : 0;
  if (solution_) {
    plc.x_um = rounded(solution_->found.pose.x_mm * 1000);
    plc.y_um = rounded(solution_->found.pose.y_mm * 1000);
    plc.theta_mdeg = rounded(deg(solution_->found.pose.theta_rad) * 1000);
    double margin = 0;
    for (std::size_t i = 0; i < solution_->certificates.size(); ++i) {
      const auto& c = solution_->certificates[i];
      margin = i == 0 ? c.tolerance_mm - c.bound_mm : std::min(margin, c.tolerance_mm - c.bound_mm);
    }
    plc.worst_weld_margin_mm = static_cast<float>(margin);
  }
}

}  // namespace weldcell::job
