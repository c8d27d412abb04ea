// How the cell reacts: rows, guards, actions and faults.
#include "weldcell/job/cell.hpp"

namespace weldcell::job {

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

void Cell::log(LogEvent::Level level, const std::string& text) { out_.push_back(LogEvent{level, text}); }

}  // namespace weldcell::job
