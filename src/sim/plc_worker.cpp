#include "sim/plc_worker.hpp"

namespace weldcell::sim {

using wire::PackState;
using wire::PlcCommand;

namespace {
constexpr double kAckPatience_s = 2.0;
constexpr int kPhaseFaulted = 14, kPhaseInterrupted = 15;  // docs/PLC.md
constexpr double kRetry_s = 1.0;  // a refused command is tried again, without filling the cell's log
}  // namespace

PlcCommand PlcWorker::wanted(const wire::PlcStatus& status, double now_s) {
  if (status.guide_step != step_) {
    step_ = status.guide_step;
    step_seen_s_ = now_s;
    if (step_ == 0) confirmed_ = 0;
  }
  switch (status.state) {
    case PackState::Idle:
      if (status.job_number == 0) return PlcCommand::None;
      return status.armed ? PlcCommand::Start : PlcCommand::Arm;
    case PackState::Execute:
      if (step_ == 0 || confirmed_ == step_ || now_s - step_seen_s_ < confirm_after_s_)
        return PlcCommand::None;
      return PlcCommand::Confirm;
    case PackState::Complete:
      return PlcCommand::Reset;
    case PackState::Stopped:
      if (status.phase != kPhaseFaulted && status.phase != kPhaseInterrupted) return PlcCommand::Reset;
      if (!rearm_) return PlcCommand::None;
      return status.armed ? PlcCommand::Resume : PlcCommand::Arm;
    case PackState::Aborted:
      return rearm_ ? PlcCommand::Clear : PlcCommand::None;
    default:
      return PlcCommand::None;
  }
}

wire::PlcOrder PlcWorker::step(const wire::PlcStatus& status, double now_s) {
  ++order_.heartbeat;
  if (!begun_) {
    // The number found at the start counts as taken; go on from it.
    begun_ = true;
    order_.command_sequence = status.command_ack;
  }
  const bool answered = status.command_ack == order_.command_sequence;
  if (!answered && now_s - sent_s_ < kAckPatience_s) return order_;
  if (answered && last_ == PlcCommand::Confirm && status.command_result == 0) confirmed_ = confirming_;
  const PlcCommand next = wanted(status, now_s);
  if (next == PlcCommand::None) return order_;
  if (next == PlcCommand::Confirm) confirming_ = step_;
  if (answered && next == order_.command && now_s - sent_s_ < kRetry_s) return order_;
  last_ = order_.command = next;
  order_.job_number = status.job_number;
  ++order_.command_sequence;
  sent_s_ = now_s;
  return order_;
}

}  // namespace weldcell::sim
