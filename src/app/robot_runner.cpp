#include "weldcell/app/robot_runner.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <vector>

#include "weldcell/base/units.hpp"
#include "weldcell/weld/resident.hpp"

namespace weldcell::app {

namespace {

constexpr Nanoseconds kPollInterval = 150 * kMillisecond, kSlowPoll = kSecond;
constexpr double kHaltTimeout = 5, kMoveTimeout = 60;
constexpr const char* kJobModule = "WeldcellJob";

std::string jointtarget(const kinematics::Joints& q) {
  return fmt::format("[[{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f}],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]]",
                     deg(q[0]), deg(q[1]), deg(q[2]), deg(q[3]), deg(q[4]), deg(q[5]));
}

}  // namespace

void RobotRunner::begin(const job::RobotRequest& request, HostTime now) {
  request_ = request;
  since_ = next_poll_ = now;
  const bool while_running = request.task == job::RobotTask::Query || request.task == job::RobotTask::Allow;
  phase_ = while_running ? Phase::Act : Phase::Halt;
}

std::optional<job::RobotReply> RobotRunner::step(HostTime now) {
  if (phase_ == Phase::Idle || now < next_poll_) return std::nullopt;
  next_poll_ = now + kPollInterval;
  switch (phase_) {
    case Phase::Idle:
      break;
    case Phase::Halt: {
      // Whatever runs belongs to an earlier request: stop it before anything is written.
      was_running_ = false;
      const Status halted = halt();
      if (!halted.ok()) return answer(halted);
      if (request_.own_only && !was_running_) return answer(Done{});
      phase_ = Phase::AwaitHalt;
      break;
    }
    case Phase::AwaitHalt:
      return await_halt(now);
    case Phase::Act: {
      if (request_.task == job::RobotTask::Query) {
        phase_ = Phase::Idle;
        return query();
      }
      const Status acted = act();
      if (!acted.ok() || request_.task != job::RobotTask::Move) return answer(acted);
      phase_ = Phase::AwaitEnd;
      since_ = now;
      break;
    }
    case Phase::AwaitEnd:
      return await_end(now);
  }
  return std::nullopt;
}

bool RobotRunner::worth_asking(HostTime now) {
  // An event may be late, never early: "running" saves the question, "stopped" is confirmed by one.
  const bool told_running =
      view_ != nullptr && view_->live && view_->execution == adapters::ExecutionState::Running;
  if (told_running && now - asked_ < kSlowPoll) {
    next_poll_ = now;
    return false;
  }
  asked_ = now;
  return true;
}

std::optional<job::RobotReply> RobotRunner::await_halt(HostTime now) {
  if (!worth_asking(now)) return std::nullopt;
  const auto running = rws_->execution_state();
  if (!running.ok()) return answer(running.error());
  if (*running == adapters::ExecutionState::Stopped) {
    if (request_.task == job::RobotTask::Stop) {
      job::RobotReply reply = answer(Done{});
      reply.running = was_running_;
      reply.text = latest_events();
      return reply;
    }
    phase_ = Phase::Act;
    next_poll_ = now;
  } else if (seconds(now - since_) > kHaltTimeout) {
    return answer(Error{"robot.halt", "RAPID", "the program did not stop", "stop it on the FlexPendant"});
  }
  return std::nullopt;
}

std::optional<job::RobotReply> RobotRunner::await_end(HostTime now) {
  if (!worth_asking(now)) return std::nullopt;
  const auto running = rws_->execution_state();
  if (!running.ok()) return answer(running.error());
  if (*running != adapters::ExecutionState::Stopped) {
    if (seconds(now - since_) <= kMoveTimeout) return std::nullopt;
    return answer(
        Error{"robot.move", "RAPID", "the move did not end within 60 s", "look at the FlexPendant"});
  }
  const auto state = rws_->read_symbol(task_, weld::kResidentModule, weld::kStateSymbol);
  if (!state.ok()) return answer(state.error());
  if (*state == std::to_string(static_cast<int>(weld::ResidentState::There))) return answer(Done{});
  return answer(Error{"robot.move", "RAPID", "the move stopped before its end: " + latest_events(),
                      "clear the cause, arm and resume"});
}

job::RobotReply RobotRunner::answer(const Status& status) {
  phase_ = Phase::Idle;
  if (!status.ok()) resident_checked_ = false;
  job::RobotReply reply;
  reply.id = request_.id;
  reply.ok = status.ok();
  if (!status.ok()) reply.text = status.error().text();
  return reply;
}

Status RobotRunner::halt() {
  const auto running = rws_->execution_state();
  if (!running.ok()) return running.error();
  if (*running == adapters::ExecutionState::Stopped) return Done{};
  if (request_.own_only) {
    const auto module = rws_->pointer_module(task_);
    if (module.ok() && *module != weld::kResidentModule && *module != kJobModule) return Done{};
  }
  was_running_ = true;
  return rws_->stop();
}

Status RobotRunner::act() {
  using job::RobotTask;
  if (request_.task == RobotTask::Upload) {
    const std::string path = rws_->module_path(kJobModule);
    if (auto s = rws_->upload_file(path, request_.module_text); !s.ok()) return s;
    auto lease = rws_->lease(adapters::MastershipDomain::Rapid);
    if (!lease.ok()) return lease.error();
    if (auto s = rws_->load_module(task_, path); !s.ok()) return s;
    return lease->release();
  }
  if (request_.task == RobotTask::Allow) {
    auto lease = rws_->lease(adapters::MastershipDomain::Rapid);
    if (!lease.ok()) return lease.error();
    const std::string count = std::to_string(request_.allowed_seams);
    if (auto s = rws_->write_symbol(task_, kJobModule, "nSeamsAllowed", count); !s.ok()) return s;
    return lease->release();
  }
  if (auto s = make_ready(); !s.ok()) return s;
  switch (request_.task) {
    case RobotTask::Move:
      return run_routine(weld::kResidentModule, weld::kMoveRoutine, weld::kResidentModule, weld::kStartSymbol,
                         jointtarget(request_.joints));
    case RobotTask::OpenScan:
      return run_routine(weld::kResidentModule, weld::kScanRoutine, weld::kResidentModule, weld::kStartSymbol,
                         jointtarget(request_.joints));
    case RobotTask::Weld:
      return run_routine(kJobModule, "WeldcellWeld", kJobModule, "nSeamsToSkip",
                         std::to_string(request_.skip_seams));
    default:
      return Done{};
  }
}

Status RobotRunner::make_ready() {
  const auto mode = rws_->operation_mode();
  if (!mode.ok()) return mode.error();
  if (*mode != adapters::OperationMode::Auto) {
    return Error{"robot.mode", "robot controller",
                 std::string("operation mode is ") + adapters::to_string(*mode),
                 "turn the key to automatic and confirm on the FlexPendant"};
  }
  const auto state = rws_->controller_state();
  if (!state.ok()) return state.error();
  if (*state == adapters::ControllerState::MotorsOff) {
    if (auto s = rws_->set_motors(true); !s.ok()) return s;
  } else if (*state != adapters::ControllerState::MotorsOn) {
    return Error{"robot.state", "robot controller",
                 std::string("controller state is ") + adapters::to_string(*state),
                 "release the emergency stop or close the guard, press Motors On, then arm and resume"};
  }
  return make_resident();
}

Status RobotRunner::make_resident() {
  if (resident_checked_) return Done{};
  const auto loaded = rws_->modules(task_);
  if (!loaded.ok()) return loaded.error();
  const bool there = std::find(loaded->begin(), loaded->end(), weld::kResidentModule) != loaded->end();
  const std::string path = rws_->module_path(weld::kResidentModule);
  const auto text = rws_->download_file(path);
  if (!there || !text.ok() || *text != resident_) {
    if (auto s = rws_->upload_file(path, resident_); !s.ok()) return s;
    auto lease = rws_->lease(adapters::MastershipDomain::Rapid);
    if (!lease.ok()) return lease.error();
    if (auto s = rws_->load_module(task_, path); !s.ok()) return s;
    if (auto s = lease->release(); !s.ok()) return s;
  }
  resident_checked_ = true;
  return Done{};
}

Status RobotRunner::run_routine(const std::string& module, const std::string& routine,
                                const std::string& symbol_module, const std::string& symbol,
                                const std::string& literal) {
  auto lease = rws_->lease(adapters::MastershipDomain::Rapid);
  if (!lease.ok()) return lease.error();
  if (auto s = rws_->write_symbol(task_, symbol_module, symbol, literal); !s.ok()) return s;
  if (auto s = rws_->set_pp_to_routine(task_, module, routine); !s.ok()) return s;
  if (auto s = lease->release(); !s.ok()) return s;
  return rws_->start();
}

std::string RobotRunner::latest_events() {
  constexpr int kLookBack = 6;
  constexpr std::size_t kTold = 3;
  // Program started, or restarted: what lies before is history.
  constexpr std::array kStarted{10150, 10151, 10155, 10156};
  const auto events = rws_->event_log(kLookBack);
  if (!events.ok()) return {};
  std::vector<std::string> told;
  for (const auto& event : *events) {
    if (std::ranges::find(kStarted, event.code) != kStarted.end() || told.size() == kTold) break;
    told.push_back(std::to_string(event.code) + " " + event.title);
  }
  return told.empty() ? "no entry in the event log" : fmt::format("{}", fmt::join(told, ", "));
}

job::RobotReply RobotRunner::query() {
  const auto running = rws_->execution_state();
  if (!running.ok()) return answer(running.error());
  const auto seams = rws_->read_symbol(task_, kJobModule, "nSeamsDone");
  if (!seams.ok()) return answer(seams.error());
  const auto begun = rws_->read_symbol(task_, kJobModule, "nSeamsBegun");
  if (!begun.ok()) return answer(begun.error());
  const auto allowed = rws_->read_symbol(task_, kJobModule, "nSeamsAllowed");
  // A module of an earlier version has no such symbol; how far it came is told all the same.
  if (!allowed.ok() && allowed.error().code != "rws.not_found") return answer(allowed.error());
  job::RobotReply reply = answer(Done{});
  reply.running = *running != adapters::ExecutionState::Stopped;
  reply.seams_done = std::atoi(seams->c_str());
  reply.seams_begun = std::atoi(begun->c_str());
  reply.seams_allowed = allowed.ok() ? std::atoi(allowed->c_str()) : 0;
  if (!reply.running) reply.text = latest_events();
  return reply;
}

}  // namespace weldcell::app
