#include "weldcell/job/cell.hpp"

#include <algorithm>
#include <utility>

namespace weldcell::job {

const char* to_string(Link link) {
  switch (link) {
    case Link::Laser:
      return "laser";
    case Link::Rws:
      return "robot controller";
    case Link::Plc:
      return "PLC";
  }
  return "?";
}

const char* to_string(FaultCode code) {
  if (code == FaultCode::None) return "none";
  const wire::PlcAlarm* alarm = wire::plc_alarm(static_cast<std::uint16_t>(code));
  return alarm != nullptr ? alarm->text : "?";
}

const char* to_string(RobotTask task) {
  switch (task) {
    case RobotTask::Move:
      return "move";
    case RobotTask::OpenScan:
      return "open scan";
    case RobotTask::Stop:
      return "stop";
    case RobotTask::Upload:
      return "upload";
    case RobotTask::Weld:
      return "weld";
    case RobotTask::Query:
      return "query";
    case RobotTask::Allow:
      return "allow the next seam";
  }
  return "?";
}

Cell::Cell(const cell::CellSetup& setup, const wire::LaserFormat& laser, bool plc_required,
           CellTimeouts timeouts)
    : setup_(setup), plc_required_(plc_required), timeouts_(timeouts), laser_decoder_(laser) {
  refresh_plc();
}

Outputs Cell::step(const Input& input) {
  now_ = input.time;
  out_.clear();
  refusal_.clear();
  std::visit([this](const auto& body) { on(body); }, input.body);
  refresh_plc();
  return std::exchange(out_, {});
}

CellMemory Cell::memory() const {
  return {status_.state,   status_.armed, status_.links,    next_request_,     last_sequence_,
          sequence_known_, selected_job_, watches_latency_, latency_drift_ms_, latency_jobs_};
}

void Cell::recall(const CellMemory& memory) {
  status_.state = memory.state;
  status_.armed = memory.armed;
  status_.links = memory.links;
  next_request_ = memory.next_request;
  last_sequence_ = memory.last_sequence;
  sequence_known_ = memory.sequence_known;
  selected_job_ = memory.selected_job;
  watches_latency_ = memory.watches_latency;
  latency_drift_ms_ = memory.latency_drift_ms;
  latency_jobs_ = memory.latency_jobs;
  latency_drifted_ = latency_beyond();
  refresh_plc();
}

bool Cell::wants_laser() const {
  return status_.state == State::PreparingScan || status_.state == State::Scanning;
}

bool Cell::takes_jobs() const {
  // Complete and Stopped stay for a PLC to read until it resets.
  const bool plc_reads = plc_required_ && status_.links[static_cast<std::size_t>(Link::Plc)];
  return status_.state == State::Idle || (ended(status_.state) && !plc_reads);
}

// ---- inputs ----

void Cell::on(const Tick&) {
  switch (status_.state) {
    case State::PreparingScan:
      if (seconds(now_ - state_since_) > timeouts_.egm_open_s) {
        fault(FaultCode::EgmNotStarted, "no running EGM session within " +
                                            std::to_string(static_cast<int>(timeouts_.egm_open_s)) +
                                            " s: look at the FlexPendant's event log, at UdpUc address and "
                                            "port, and at module WeldcellEgm");
      }
      break;
    case State::Scanning:
      watch_scan();
      break;
    case State::Welding:
      if (program_started_ && awaited_request_ == 0 && seconds(now_ - last_query_) > timeouts_.query_s) {
        last_query_ = now_;
        request(RobotTask::Query);
      }
      break;
    case State::Faulted:
    case State::Interrupted:
      chase_stop();
      break;
    default:
      break;
  }
}

void Cell::chase_stop() {
  const bool reachable = status_.links[static_cast<std::size_t>(Link::Rws)];
  if (!stop_owed_ || !reachable || seconds(now_ - last_stop_) < timeouts_.stop_again_s) return;
  if (stop_request_ == 0) request(RobotTask::Stop);
}

void Cell::watch_scan() {
  if (seconds(now_ - last_laser_) > timeouts_.laser_gap_s) {
    fault(FaultCode::LaserLost,
          "no laser readings: check the sensor's power and network, then arm and resume");
  } else if (motion_finished_) {
    if (seconds(now_ - motion_done_at_) >= timeouts_.settle_s) fire(Event::MotionDone);
  } else if (seconds(now_ - last_egm_) > timeouts_.egm_gap_s) {
    fault(FaultCode::EgmLost,
          "the robot controller sends no EGM frames: it has stopped the robot, or does so by its time-out");
  }
}

void Cell::on(const EgmCycle& cycle) {
  last_egm_ = now_;
  wire::EgmFeedback feedback;
  if (codec_.decode(cycle.datagram, feedback) != wire::EgmDecode::Ok) return;
  const bool running = feedback.motors == wire::MotorState::On && feedback.mci == wire::MciState::Running &&
                       feedback.rapid != wire::RapidState::Stopped;
  if (status_.state == State::PreparingScan) {
    // Frames before the program was started anew belong to an earlier session; and a few in a row, so that a
    // session that dies at once does not count as open.
    constexpr int kSettledFrames = 5;
    const bool opened = awaited_request_ == 0;
    running_frames_ = running && opened ? running_frames_ + 1 : 0;
    if (running_frames_ >= kSettledFrames) fire(Event::EgmReady);
    return;
  }
  if (status_.state != State::Scanning || motion_finished_) return;
  scan_->feedback.push_back({now_, feedback});

  const auto& plan = scan_plan();
  const robot::EgmReport& report = cycle.report;
  if (!running) {
    fault(FaultCode::RobotStopped,
          "the controller left EGM while scanning (motors off, emergency stop or program stop)");
  } else if (motion_started_ && report.plan_id == plan->id && report.plan_done) {
    // Before this plan was begun, the report still says that the last one came to its end.
    motion_finished_ = true;
    motion_done_at_ = now_;
    status_.progress = 1;
  } else if (report.plan_id == plan->id && report.phase == robot::EgmPhase::Following) {
    motion_started_ = true;
    status_.progress = plan->duration_s() > 0 ? report.plan_time_s / plan->duration_s() : 1;
  } else if (motion_started_) {
    fault(FaultCode::EgmLost, "the EGM session restarted or stopped in the middle of the scan");
  } else if (report.refusal != robot::EgmRefusal::None && seconds(now_ - state_since_) > timeouts_.offer_s) {
    fault(FaultCode::MotionRefused,
          std::string("the motion was not begun: ") + robot::to_string(report.refusal));
  } else if (seconds(now_ - state_since_) > 2.0) {
    fault(FaultCode::MotionRefused, "the motion did not begin within 2 s");
  }
}

void Cell::on(const LaserBytes& bytes) {
  last_laser_ = now_;
  const bool keep = status_.state == State::Scanning;
  laser_decoder_.feed(bytes.bytes, [&](const wire::LaserReading& reading) {
    if (keep) scan_->readings.push_back({now_, reading});
  });
}

void Cell::on(const LinkChange& change) {
  bool& up = status_.links[static_cast<std::size_t>(change.link)];
  if (change.link == Link::Laser) laser_trouble_ = change.up ? std::string() : change.detail;
  if (up == change.up) return;
  up = change.up;
  log(up ? LogEvent::Level::Info : LogEvent::Level::Warning,
      std::string(to_string(change.link)) + (up ? " connected" : " lost") +
          (change.detail.empty() ? "" : ": " + change.detail));
  if (up) return;
  const State state = status_.state;
  if (change.link == Link::Laser && state == State::Scanning) {
    fault(FaultCode::LaserLost, "the laser's connection closed: " + change.detail);
  }
  if (change.link == Link::Plc && plc_required_ && under_way(state) && state != State::Importing &&
      state != State::Planning && state != State::Ready) {
    fault(FaultCode::PlcLost, "the PLC's heartbeat stopped: controlled stop");
  }
}

void Cell::on(const PlcInput& input) {
  const wire::PlcOrder& order = input.order;
  // What stands in the registers when the PLC connects is history, not an order.
  const bool fresh = sequence_known_ && order.command_sequence != last_sequence_;
  sequence_known_ = true;
  last_sequence_ = order.command_sequence;
  status_.plc.command_ack = order.command_sequence;
  if (fresh)
    status_.plc.command_result = static_cast<std::uint16_t>(command(order.command, order.job_number, "plc"));
}

void Cell::on(const OperatorCommand& order) { command(order.command, 0, order.who); }

void Cell::on(const StorageLost& lost) { fault(FaultCode::StateNotSaved, lost.text); }

void Cell::on(const JobArrived& arrived) {
  WELDCELL_ASSERT(status_.state == State::Idle || ended(status_.state));
  if (selected_job_ != 0 && !arrived.interrupted) {
    if (shown_number(arrived.order) != selected_job_) {
      // It was on its way while the PLC chose another one.
      out_.push_back(ReturnJob{});
      return;
    }
    select_job(0);
  }
  job_ = JobInput{arrived.order, {}};
  job_id_ = arrived.id;
  prepared_.reset();
  next_pass_.reset();
  solution_.reset();
  scan_.reset();
  failure_.clear();
  cleared_ = false;
  resuming_ = false;
  guidance_done_ = arrived.guidance_done;
  guide_step_ = 0;
  status_.job = arrived.order.name;
  status_.fault = FaultCode::None;
  status_.fault_text.clear();
  status_.pass = 0;
  status_.progress = 0;
  status_.seams_done = arrived.seams_done;
  weld_begun_ = arrived.weld_begun;
  awaited_request_ = seams_request_ = stop_request_ = 0;
  stop_owed_ = stop_own_only_ = false;
  seams_known_ = !weld_begun_;
  interrupted_seam_ = 0;
  status_.seams = 0;
  status_.plc.job_number = 0;
  if (!arrived.interrupted) {
    fire(Event::JobArrived);
    return;
  }
  if (status_.state != State::Idle) enter(State::Idle);
  resume_state_ = guidance_done_ || !arrived.order.guidance ? State::PreparingScan : State::GuideMoving;
  log(LogEvent::Level::Warning,
      "job '" + arrived.order.name +
          "' was interrupted: make the cell safe, then arm and resume it, or abort it");
  fire(Event::JobFound);
  // Nobody has armed this process, so nothing of weldcell's may move; another program is not its business.
  stop_owed_ = stop_own_only_ = true;
  status_.fault_text = weld_begun_
                           ? "interrupted while welding: RAPID may still be welding the seam at hand, "
                             "and is stopped as soon as the controller answers"
                           : "interrupted: RAPID may still be moving the robot, and is stopped as soon "
                             "as the controller answers";
  log(LogEvent::Level::Warning, status_.fault_text);
  chase_stop();
}

void Cell::on(const ImportDone& done) {
  if (status_.state != State::Importing) return;
  if (!done.workpiece.ok()) {
    failure_ = done.workpiece.error().text();
    fire(Event::StepFailed);
    return;
  }
  job_->workpiece = *done.workpiece;
  status_.seams = static_cast<int>(job_->workpiece.welds.size());
  fire(Event::Imported);
}

void Cell::on(const PlanDone& done) {
  if (status_.state != State::Planning) return;
  if (!done.prepared.ok()) {
    failure_ = done.prepared.error().text();
    fire(Event::StepFailed);
    return;
  }
  prepared_ = *done.prepared;
  status_.guide_steps = static_cast<int>(prepared_->steps.size());
  fire(Event::Planned);
}

void Cell::on(const PassPlanned& done) {
  if (status_.state != State::PlanningPass) return;
  if (!done.pass.ok()) {
    failure_ = done.pass.error().text();
    fire(Event::StepFailed);
    return;
  }
  next_pass_ = *done.pass;
  fire(Event::Planned);
}

void Cell::on(const SolveDone& done) {
  if (status_.state != State::Localizing) return;
  solution_ = done.solution;
  failure_ = solution_->verdict.reason;
  if (watches_latency_) watch_laser();
  fire(Event::Solved);
}

void Cell::on(const RobotReply& reply) {
  if (reply.id == 0) return;
  if (reply.id == stop_request_) return settle_stop(reply);
  if (reply.id == seams_request_) {
    seams_request_ = 0;
    if (reply.ok) return settle_seams(reply);
    return fault(FaultCode::RobotCommand, "how many seams were welded is not known: " + reply.text);
  }
  if (reply.id != awaited_request_) return;
  awaited_request_ = 0;
  if (!reply.ok) {
    if (under_way(status_.state)) {
      fault(FaultCode::RobotCommand,
            std::string("robot command '") + to_string(awaited_task_) + "': " + reply.text);
    }
    return;
  }
  switch (awaited_task_) {
    case RobotTask::Move:
    case RobotTask::Upload:
      fire(Event::RobotDone);
      break;
    case RobotTask::Weld:
      program_started_ = true;
      last_query_ = now_;
      break;
    case RobotTask::Query:
      if (status_.state == State::Welding) weld_goes_on(reply);
      break;
    default:
      break;
  }
}

void Cell::weld_goes_on(const RobotReply& reply) {
  if (reply.seams_done > status_.seams_done) {
    status_.seams_done = reply.seams_done;
    status_.progress = status_.seams > 0 ? static_cast<double>(status_.seams_done) / status_.seams : 1;
    log(LogEvent::Level::Info,
        "seam " + std::to_string(status_.seams_done) + " of " + std::to_string(status_.seams) + " welded");
    save_state();
  }
  if (!reply.running) {
    if (fire(Event::ProgramEnded)) return;
    return fault(FaultCode::ProgramStopped, "the weld program stopped after seam " +
                                                std::to_string(status_.seams_done) + " of " +
                                                std::to_string(status_.seams) + ": " + reply.text);
  }
  // RAPID waits before each seam for a word that is newer than the seam before it.
  const bool waits = reply.seams_done == status_.seams_done && reply.seams_allowed <= status_.seams_done;
  if (waits && status_.armed && status_.seams_done < status_.seams) request(RobotTask::Allow);
}

void Cell::settle_stop(const RobotReply& reply) {
  stop_request_ = 0;
  if (!reply.ok) return;  // sent again while the cell stands
  stop_owed_ = false;
  if (status_.state == State::Interrupted) {
    status_.fault_text.clear();
    if (reply.running) {
      log(LogEvent::Level::Warning, weld_begun_ ? "RAPID was still welding: stopped; look at the seam at hand"
                                                : "RAPID still ran from before: stopped");
    }
    return;
  }
  const bool told_by_egm = status_.fault == FaultCode::EgmLost || status_.fault == FaultCode::EgmNotStarted ||
                           status_.fault == FaultCode::RobotStopped;
  if (status_.state != State::Faulted || !told_by_egm || reply.text.empty()) return;
  // EGM only fell silent; the controller knows why.
  status_.fault_text += "; the controller's log: " + reply.text;
  log(LogEvent::Level::Error, "the controller's log: " + reply.text);
}

void Cell::settle_seams(const RobotReply& reply) {
  status_.seams_done = std::max(status_.seams_done, reply.seams_done);
  if (reply.seams_begun > status_.seams_done) {
    // Nobody knows how far its arc came: a machine must not weld it again.
    interrupted_seam_ = status_.seams_done = reply.seams_begun;
    log(LogEvent::Level::Warning,
        "seam " + std::to_string(interrupted_seam_) + " was interrupted: it is left out; finish it by hand");
  }
  seams_known_ = true;
  save_state();
}

void Cell::on(const Overrun& overrun) {
  if (status_.state != State::Scanning) return;
  fault(FaultCode::LaserOverrun, std::string(to_string(overrun.link)) + ": " + std::to_string(overrun.lost) +
                                     " blocks lost inside the controller: the machine is overloaded");
}

}  // namespace weldcell::job
