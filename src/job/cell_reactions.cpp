// How the cell reacts: rows, guards, actions, faults and commands.
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

bool Cell::fire(Event event) {
  for (const Row& row : kRows) {
    if (row.from != status_.state || row.event != event || !holds(row.guard)) continue;
    enter(row.to);
    act(row.action);
    return true;
  }
  return false;
}

void Cell::enter(State state) {
  if (state == status_.state) return;
  log(LogEvent::Level::Info, std::string(to_string(status_.state)) + " -> " + to_string(state));
  status_.state = state;
  state_since_ = now_;
  save_state();
}

void Cell::save_state() {
  out_.push_back(SaveState{status_.state, status_.seams_done, guidance_done_, weld_begun_});
}

bool Cell::holds(Guard guard) const {
  const bool from_scan = resuming_ && (guidance_done_ || !job_->order.guidance);
  const bool welds = solution_ && solution_->verdict.verdict == localize::Verdict::Weld;
  switch (guard) {
    case Guard::Always:
      return true;
    case Guard::Guided:
      return job_->order.guidance;
    case Guard::Unguided:
      return !job_->order.guidance;
    case Guard::MoreSteps:
      return guide_step_ + 1 < status_.guide_steps;
    case Guard::LastStep:
      return guide_step_ + 1 >= status_.guide_steps;
    case Guard::MorePasses: {
      if (status_.pass >= max_passes(job_->order) || !solution_) return false;
      const auto pose_verdict = solution_->found.verdict;
      if (pose_verdict == localize::Verdict::Reject) return false;
      const bool sparse_first =
          job_->order.inspection.pattern == plan::Pattern::Adaptive && status_.pass == 1;
      return sparse_first || solution_->verdict.verdict == localize::Verdict::Rescan;
    }
    case Guard::WeldCertified:
      return welds;
    case Guard::NotCertified:
      return !welds;
    case Guard::ArcAllowed:
      return job_->order.execute_weld && status_.armed && seams_known_ && welds && !solution_->rapid.empty();
    case Guard::WeldNotWanted:
      return !job_->order.execute_weld;
    case Guard::AllSeamsDone:
      return status_.seams_done >= status_.seams;
    case Guard::ResumeNowhere:
      return !resuming_;
    case Guard::ResumeAtGuide:
      return resuming_ && !from_scan;
    case Guard::ResumeAtScan:
      return from_scan;
  }
  return false;
}

void Cell::act(Action action) {
  switch (action) {
    case Action::None:
      break;
    case Action::Import:
      out_.push_back(ImportRequest{});
      break;
    case Action::Recover:
      resuming_ = resume_state_ != State::Importing && resume_state_ != State::Planning &&
                  resume_state_ != State::Ready;
      status_.fault = FaultCode::None;
      status_.fault_text.clear();
      status_.pass = 0;
      stop_own_only_ = false;
      if (weld_begun_) {
        seams_known_ = false;
        request(RobotTask::Stop);
        request(RobotTask::Query);
      }
      out_.push_back(ImportRequest{});
      break;
    case Action::Plan:
      out_.push_back(PlanRequest{});
      break;
    case Action::MoveToGuide:
      if (status_.guide_step > 0) ++guide_step_;
      status_.guide_step = 0;
      out_.push_back(ShowDrawing{});
      request(RobotTask::Move);
      break;
    case Action::ShowStep: {
      status_.guide_step = guide_step_ + 1;
      const auto index = static_cast<std::size_t>(guide_step_);
      auto drawing = std::make_shared<guidance::Drawing>(
          guidance::draw_step(setup_, job_->workpiece, prepared_->planned, prepared_->steps, index,
                              prepared_->step_poses[index].T_base_projector));
      log(LogEvent::Level::Info, "guidance: " + prepared_->steps[index].title);
      out_.push_back(ShowDrawing{std::move(drawing), status_.guide_step});
      break;
    }
    case Action::BeginScan:
      begin_scan();
      break;
    case Action::FollowPlan:
      scan_ = std::make_shared<ScanRecord>();
      // Room for the whole pass at once: growing in steps would double the memory at the worst moment.
      scan_->feedback.reserve(
          static_cast<std::size_t>(scan_plan()->duration_s() / setup_.egm.cycle_ms * 1000 * 1.1) + 500);
      scan_->readings.reserve(
          static_cast<std::size_t>(scan_plan()->duration_s() * setup_.laser.rate_hz * 1.1) + 5000);
      motion_started_ = motion_finished_ = false;
      last_laser_ = last_egm_ = now_;
      status_.progress = 0;
      out_.push_back(StartMotion{scan_plan()});
      break;
    case Action::Solve:
      out_.push_back(SolveRequest{scan_});
      scan_.reset();
      request(RobotTask::Stop);
      break;
    case Action::PlanPass:
      out_.push_back(PassRequest{});
      break;
    case Action::Upload:
      request(RobotTask::Upload);
      break;
    case Action::Weld:
      program_started_ = false;
      weld_begun_ = true;
      save_state();
      status_.progress = 0;
      request(RobotTask::Weld);
      break;
    case Action::Finish:
      if (status_.state == State::Done) {
        if (interrupted_seam_ > 0) {
          finish_with(
              false, "weld",
              "all other seams are welded; seam " + std::to_string(interrupted_seam_) + " was interrupted");
        } else {
          finish_with(true, solution_ ? localize::to_string(solution_->verdict.verdict) : "done",
                      job_->order.execute_weld ? "all seams welded" : "re-planned program uploaded, not run");
        }
      } else {
        const bool judged = solution_ && solution_->verdict.verdict != localize::Verdict::Weld;
        finish_with(false, judged ? localize::to_string(solution_->verdict.verdict) : "failed",
                    failure_.empty() ? "aborted by a person" : failure_);
      }
      break;
    case Action::PutBack:
      set_armed(false);
      out_.push_back(ReturnJob{});
      [[fallthrough]];
    case Action::Clear:
      job_.reset();
      status_.job.clear();
      status_.plc.job_number = 0;
      break;
  }
}

void Cell::begin_scan() {
  if (status_.guide_step > 0) {
    guidance_done_ = true;
    status_.guide_step = 0;
    out_.push_back(ShowDrawing{});
    save_state();
  }
  ++status_.pass;
  running_frames_ = 0;
  laser_decoder_.reset();
  request(RobotTask::OpenScan);
}

const std::shared_ptr<const plan::MotionPlan>& Cell::scan_plan() const {
  return status_.pass <= 1 ? prepared_->scan : next_pass_->scan;
}

void Cell::request(RobotTask task) {
  RobotRequest request;
  request.id = next_request_++;
  request.task = task;
  switch (task) {
    case RobotTask::Move:
      request.joints = prepared_->step_poses[static_cast<std::size_t>(guide_step_)].joints;
      break;
    case RobotTask::OpenScan:
      request.joints = scan_plan()->samples.front().q;
      break;
    case RobotTask::Upload:
      request.module_text = solution_->rapid;
      break;
    case RobotTask::Weld:
      request.skip_seams = status_.seams_done;
      break;
    case RobotTask::Allow:
      request.allowed_seams = status_.seams_done + 1;
      break;
    default:
      break;
  }
  if (task == RobotTask::Stop) {
    request.own_only = stop_own_only_;
    stop_request_ = request.id;
    stop_owed_ = true;
    last_stop_ = now_;
  } else if (task == RobotTask::Query && status_.state != State::Welding) {
    seams_request_ = request.id;
  } else {
    awaited_request_ = request.id;
    awaited_task_ = task;
  }
  out_.push_back(std::move(request));
}

void Cell::fault(FaultCode code, const std::string& text) {
  if (!under_way(status_.state)) return;
  log(LogEvent::Level::Error, std::string(to_string(code)) + " in " + to_string(status_.state) + ": " + text);
  resume_state_ = status_.state;
  awaited_request_ = seams_request_ = 0;
  scan_.reset();
  stop_own_only_ = false;
  status_.fault = code;
  status_.fault_text = text;
  cleared_ = false;
  status_.guide_step = 0;
  out_.push_back(StopMotion{});
  request(RobotTask::Stop);
  set_armed(false);
  out_.push_back(ShowDrawing{});
  enter(State::Faulted);
}

void Cell::finish_with(bool accepted, const std::string& verdict, const std::string& reason) {
  awaited_request_ = seams_request_ = 0;
  stop_own_only_ = false;
  status_.guide_step = 0;
  out_.push_back(StopMotion{});
  if (!accepted) request(RobotTask::Stop);
  set_armed(false);
  out_.push_back(ShowDrawing{});
  const std::string words = accepted ? reason : reason + ": weld manually";
  log(accepted ? LogEvent::Level::Info : LogEvent::Level::Error,
      "job '" + job_->order.name + "' " + verdict + ": " + words);
  out_.push_back(FinishJob{accepted, verdict, words});
}

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

void Cell::log(LogEvent::Level level, const std::string& text) { out_.push_back(LogEvent{level, text}); }

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
