#include "app/plc_exam.hpp"

#include <fmt/format.h>

namespace weldcell::app {

namespace {

using wire::PackState;
using wire::PlcCommand;
using wire::PlcResult;

struct Rule {
  const char* name;
  const char* mend;
};

constexpr Rule kRules[] = {
    {"plc.connects", "open a connection, read 40101 and write 40001 cyclically"},
    {"plc.heartbeat", "change heartbeat at least every 500 ms, also while nothing happens"},
    {"plc.reserved_zero", "write 0 into the reserved words"},
    {"plc.known_commands", "send only the numbers of the command table"},
    {"plc.new_sequence", "change command_sequence with every command, after or with command and job_number"},
    {"plc.waits_for_echo", "send the next command only when command_ack equals command_sequence"},
    {"plc.no_start_unarmed", "send Start only while armed is 1"},
    {"plc.word_order", "set word_order in the cell file to the order in which the PLC sends a DINT"},
    {"plc.reads_result",
     "read command_result after the echo; a refused Start is sent again, at most once a second"},
    {"plc.confirm_once", "send Confirm only while guide_step is above 0, once a step"},
    {"plc.sees_lost_cell",
     "take the cell as lost when its heartbeat stands still for 2 s, and send no command then"},
    {"plc.rearm_by_person", "after a fault let a person press Clear and Arm; the program must not do it"},
    {"plc.resumes", "send Resume after Clear and Arm"},
    {"plc.resets", "send Reset when state is Complete and the result is read"},
};

const char* mend_of(const std::string& rule) {
  for (const Rule& r : kRules) {
    if (rule == r.name) return r.mend;
  }
  return "";
}

std::int32_t swapped(std::int32_t value) {
  const auto bits = static_cast<std::uint32_t>(value);
  return static_cast<std::int32_t>(bits << 16 | bits >> 16);
}

}  // namespace

void PlcExam::blame(const char* rule, std::string cause) {
  std::string& known = reached_[rule];
  if (known.empty()) known = std::move(cause);
}

void PlcExam::enter(Scene scene, HostTime at) {
  scene_ = scene;
  since_ = at;
}

std::string PlcExam::waiting_for() const {
  switch (scene_) {
    case Scene::Connect:
      return "the PLC's first write";
    case Scene::Ready:
      return "Arm";
    case Scene::Armed:
      return "Start, and Start once more after a refusal";
    case Scene::Place1:
    case Scene::Place2:
      return "Confirm";
    case Scene::Faulted:
      return "a person: Clear and Arm";
    case Scene::Cleared:
      return "a person: Arm";
    case Scene::Rearmed:
      return "Resume";
    case Scene::Complete:
      return "Reset";
    default:
      return "nothing: only the heartbeat";
  }
}

void PlcExam::write(const wire::PlcOrder& order, bool reserved_zero, HostTime at) {
  if (scene_ == Scene::Connect) {
    pass("plc.connects");
    enter(Scene::Empty, at);
    begun_ = last_beat_ = at;
    for (const char* rule : {"plc.heartbeat", "plc.reserved_zero", "plc.known_commands", "plc.new_sequence"})
      pass(rule);
    status_.command_ack = order.command_sequence;
    last_ = order;
    return;
  }
  if (!reserved_zero) blame("plc.reserved_zero", "a reserved word is not 0");
  if (order.heartbeat != last_->heartbeat) last_beat_ = at;
  if (order.command_sequence != last_->command_sequence) {
    command(order, at);
  } else if (order.command != last_->command && order.command != PlcCommand::None) {
    // Written ahead of its number is allowed; it must be followed by it.
    blame_from_ = at;
    ahead_ = true;
  }
  if (order.command_sequence != last_->command_sequence) ahead_ = false;
  last_ = order;
}

void PlcExam::command(const wire::PlcOrder& order, HostTime at) {
  const auto number = static_cast<unsigned>(order.command);
  if (pending_) {
    blame("plc.waits_for_echo", fmt::format("command {} came before {} was echoed", number, pending_->first));
  } else {
    pass("plc.waits_for_echo");
  }
  PlcResult result = PlcResult::Unknown;
  if (wire::is_plc_command(static_cast<std::uint16_t>(number))) {
    result = judge(order, at);
  } else {
    blame("plc.known_commands", fmt::format("command {}", number));
  }
  pending_ = {order.command_sequence, result};
  ack_at_ = at;
}

PlcResult PlcExam::judge(const wire::PlcOrder& order, HostTime at) {
  const PlcCommand c = order.command;
  const double in_scene_s = seconds(at - since_);
  if (c == PlcCommand::None) return PlcResult::Done;
  if (c == PlcCommand::Stop || c == PlcCommand::Hold || c == PlcCommand::Abort) return PlcResult::Refused;
  if (scene_ == Scene::Silent && in_scene_s > 2.5)
    blame("plc.sees_lost_cell", fmt::format("command {} after {:.1f} s without the cell's heartbeat",
                                            static_cast<unsigned>(c), in_scene_s));
  if (c == PlcCommand::Start) {
    if (status_.armed == 0) {
      blame("plc.no_start_unarmed", "Start while armed is 0");
      return PlcResult::NotArmed;
    }
    if (scene_ != Scene::Armed) return PlcResult::Refused;
    pass("plc.no_start_unarmed");
    if (order.job_number != 0 && order.job_number != kPlcExamJob) {
      blame("plc.word_order",
            order.job_number == swapped(kPlcExamJob)
                ? fmt::format("job_number arrives as {}: its words are swapped", order.job_number)
                : fmt::format("job_number {} where {} stands ready", order.job_number, kPlcExamJob));
      return PlcResult::OtherJob;
    }
    pass("plc.word_order");
    if (!refused_once_) {
      refused_once_ = true;
      since_ = at;
      return PlcResult::LinkMissing;
    }
    if (in_scene_s < options_.ack_delay_s)
      blame("plc.reads_result", "Start was repeated before its result was told");
    pass("plc.reads_result");
    enter(Scene::Place1, at);
    return PlcResult::Done;
  }
  if (c == PlcCommand::Confirm) {
    if (status_.guide_step == 0 || (scene_ != Scene::Place1 && scene_ != Scene::Place2)) {
      blame("plc.confirm_once", "Confirm while guide_step is 0 or the step was confirmed already");
      return PlcResult::Refused;
    }
    pass("plc.confirm_once");
    enter(scene_ == Scene::Place1 ? Scene::Move : Scene::Scan, at);
    return PlcResult::Done;
  }
  if ((c == PlcCommand::Clear || c == PlcCommand::Arm) &&
      (scene_ == Scene::Faulted || scene_ == Scene::Cleared)) {
    if (scene_ == Scene::Faulted && in_scene_s < options_.person_s)
      blame("plc.rearm_by_person",
            fmt::format("command {} came {:.2f} s after the fault: no person is that fast",
                        static_cast<unsigned>(c), in_scene_s));
    pass("plc.rearm_by_person");
    enter(c == PlcCommand::Arm ? Scene::Rearmed : Scene::Cleared, at);
    return PlcResult::Done;
  }
  if (c == PlcCommand::Arm) {
    if (scene_ == Scene::Ready) enter(Scene::Armed, at);
    return scene_ == Scene::Armed ? PlcResult::Done : PlcResult::Refused;
  }
  if (c == PlcCommand::Resume && scene_ == Scene::Rearmed) {
    pass("plc.resumes");
    enter(Scene::Weld, at);
    return PlcResult::Done;
  }
  if (c == PlcCommand::Reset && scene_ == Scene::Complete) {
    pass("plc.resets");
    enter(Scene::End, at);
    return PlcResult::Done;
  }
  return PlcResult::Refused;
}

void PlcExam::advance(HostTime at) {
  const double in_scene_s = seconds(at - since_);
  switch (scene_) {
    case Scene::Empty:
      if (in_scene_s > 1) enter(Scene::Ready, at);
      return;
    case Scene::Move:
      if (in_scene_s > 0.5) enter(Scene::Place2, at);
      return;
    case Scene::Scan:
      if (in_scene_s > 1) enter(Scene::Silent, at);
      return;
    case Scene::Silent:
      if (in_scene_s <= options_.silence_s) return;
      pass("plc.sees_lost_cell");
      enter(Scene::Faulted, at);
      return;
    case Scene::Weld:
      if (in_scene_s > 1) enter(Scene::Complete, at);
      return;
    case Scene::End:
      over_ = over_ || in_scene_s > 1;
      return;
    default:
      over_ = over_ || in_scene_s > options_.patience_s;
  }
}

wire::PlcStatus PlcExam::step(HostTime at) {
  if (begun_.ns < 0 && since_.ns == 0) since_ = at;
  advance(at);
  if (begun_.ns >= 0 && seconds(at - last_beat_) > options_.heartbeat_limit_s)
    blame("plc.heartbeat", fmt::format("it stood still for more than {:.1f} s", options_.heartbeat_limit_s));
  if (ahead_ && seconds(at - blame_from_) > 1)
    blame("plc.new_sequence", "command changed and command_sequence did not");
  if (pending_ && seconds(at - ack_at_) >= options_.ack_delay_s) {
    status_.command_ack = pending_->first;
    status_.command_result = static_cast<std::uint16_t>(pending_->second);
    pending_.reset();
  }
  if (at >= next_beat_ && scene_ != Scene::Silent) {
    next_beat_ = at + 500 * kMillisecond;
    ++own_beat_;
  }
  const bool job = scene_ != Scene::Connect && scene_ != Scene::Empty && scene_ != Scene::End;
  const bool faulted = scene_ == Scene::Faulted || scene_ == Scene::Cleared || scene_ == Scene::Rearmed;
  status_.heartbeat = own_beat_;
  status_.job_number = job ? kPlcExamJob : 0;
  status_.armed = job && scene_ != Scene::Ready && scene_ != Scene::Faulted && scene_ != Scene::Cleared &&
                          scene_ != Scene::Complete
                      ? 1
                      : 0;
  status_.guide_step = scene_ == Scene::Place1 ? 1 : scene_ == Scene::Place2 ? 2 : 0;
  status_.guide_member = status_.guide_step;
  status_.fault_code = faulted ? 20 : 0;
  status_.fault_severity = faulted ? wire::PlcSeverity::Fault : wire::PlcSeverity::None;
  switch (scene_) {
    case Scene::Connect:
    case Scene::Empty:
    case Scene::End:
      status_.state = PackState::Idle;
      status_.phase = 0;
      break;
    case Scene::Ready:
    case Scene::Armed:
      status_.state = PackState::Idle;
      status_.phase = 3;
      break;
    case Scene::Faulted:
      status_.state = PackState::Aborted;
      status_.phase = 14;
      break;
    case Scene::Cleared:
    case Scene::Rearmed:
      status_.state = PackState::Stopped;
      status_.phase = 14;
      break;
    case Scene::Complete:
      status_.state = PackState::Complete;
      status_.phase = 12;
      break;
    default:
      status_.state = PackState::Execute;
      status_.phase = scene_ == Scene::Place1 || scene_ == Scene::Place2 ? 5 : scene_ == Scene::Weld ? 11 : 7;
  }
  return status_;
}

PlcFindings PlcExam::findings() const {
  PlcFindings out;
  for (const Rule& rule : kRules) {
    const auto found = reached_.find(rule.name);
    const std::string cause =
        found == reached_.end() ? "never reached: the exam waited for " + waiting_for() : found->second;
    out.push_back({rule.name, cause.empty(), cause, cause.empty() ? "" : mend_of(rule.name)});
  }
  return out;
}

}  // namespace weldcell::app
