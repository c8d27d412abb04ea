// The job's state machine: one constexpr table of rows {from, event, guard, to, action}, checked when it
// compiles. Pure.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace weldcell::job {

/// Phases of a job. The number is what a PLC reads as `phase` (docs/PLC.md).
enum class State : std::uint8_t {
  Idle = 0,
  Importing = 1,      ///< the workpiece is read, CAD in a child process
  Planning = 2,       ///< guidance, scan and reach are computed
  Ready = 3,          ///< waits for arm and start
  GuideMoving = 4,    ///< the projector travels to the next step
  Placing = 5,        ///< the step is shown; waits for confirm
  PreparingScan = 6,  ///< RAPID moves to the scan's start and opens EGM
  Scanning = 7,
  Localizing = 8,    ///< edges, pose, certificates, torch paths
  PlanningPass = 9,  ///< the next scan pass at the found pose
  Uploading = 10,
  Welding = 11,
  Done = 12,
  Failed = 13,      ///< ended with a cause; weld manually
  Faulted = 14,     ///< stopped by a fault; the job stands and can be resumed after a new arm
  Interrupted = 15  ///< found in the spool at start; can be resumed after an arm
};
inline constexpr std::size_t kStates = 16;

enum class Event : std::uint8_t {
  JobArrived,
  JobFound,
  Imported,
  Planned,
  StepFailed,
  Start,
  RobotDone,
  Confirm,
  EgmReady,
  MotionDone,
  Solved,
  ProgramEnded,
  Abort,
  Reset,
  Resume,
  PutBack
};

enum class Guard : std::uint8_t {
  Always,
  Guided,
  Unguided,
  MoreSteps,
  LastStep,
  MorePasses,
  WeldCertified,
  NotCertified,
  ArcAllowed,
  WeldNotWanted,
  AllSeamsDone,
  ResumeNowhere,
  ResumeAtGuide,
  ResumeAtScan
};

enum class Action : std::uint8_t {
  None,
  Import,
  Plan,
  MoveToGuide,
  ShowStep,
  BeginScan,
  FollowPlan,
  Solve,
  PlanPass,
  Upload,
  Weld,
  Finish,
  Recover,
  Clear,
  PutBack
};

struct Row {
  State from;
  Event event;
  Guard guard;
  State to;
  Action action;
};

inline constexpr std::array kRows{
    Row{State::Idle, Event::JobArrived, Guard::Always, State::Importing, Action::Import},
    Row{State::Idle, Event::JobFound, Guard::Always, State::Interrupted, Action::None},
    Row{State::Importing, Event::Imported, Guard::Always, State::Planning, Action::Plan},
    Row{State::Importing, Event::StepFailed, Guard::Always, State::Failed, Action::Finish},
    Row{State::Importing, Event::Abort, Guard::Always, State::Failed, Action::Finish},
    Row{State::Planning, Event::Planned, Guard::ResumeNowhere, State::Ready, Action::None},
    Row{State::Planning, Event::Planned, Guard::ResumeAtGuide, State::GuideMoving, Action::MoveToGuide},
    Row{State::Planning, Event::Planned, Guard::ResumeAtScan, State::PreparingScan, Action::BeginScan},
    Row{State::Planning, Event::StepFailed, Guard::Always, State::Failed, Action::Finish},
    Row{State::Planning, Event::Abort, Guard::Always, State::Failed, Action::Finish},
    Row{State::Ready, Event::Start, Guard::Guided, State::GuideMoving, Action::MoveToGuide},
    Row{State::Ready, Event::Start, Guard::Unguided, State::PreparingScan, Action::BeginScan},
    Row{State::Ready, Event::Abort, Guard::Always, State::Failed, Action::Finish},
    Row{State::Ready, Event::PutBack, Guard::Always, State::Idle, Action::PutBack},
    Row{State::GuideMoving, Event::RobotDone, Guard::Always, State::Placing, Action::ShowStep},
    Row{State::GuideMoving, Event::Abort, Guard::Always, State::Failed, Action::Finish},
    Row{State::Placing, Event::Confirm, Guard::MoreSteps, State::GuideMoving, Action::MoveToGuide},
    Row{State::Placing, Event::Confirm, Guard::LastStep, State::PreparingScan, Action::BeginScan},
    Row{State::Placing, Event::Abort, Guard::Always, State::Failed, Action::Finish},
    Row{State::PreparingScan, Event::EgmReady, Guard::Always, State::Scanning, Action::FollowPlan},
    Row{State::PreparingScan, Event::Abort, Guard::Always, State::Failed, Action::Finish},
    Row{State::Scanning, Event::MotionDone, Guard::Always, State::Localizing, Action::Solve},
    Row{State::Scanning, Event::Abort, Guard::Always, State::Failed, Action::Finish},
    Row{State::Localizing, Event::Solved, Guard::MorePasses, State::PlanningPass, Action::PlanPass},
    Row{State::Localizing, Event::Solved, Guard::WeldCertified, State::Uploading, Action::Upload},
    Row{State::Localizing, Event::Solved, Guard::NotCertified, State::Failed, Action::Finish},
    Row{State::Localizing, Event::StepFailed, Guard::Always, State::Failed, Action::Finish},
    Row{State::Localizing, Event::Abort, Guard::Always, State::Failed, Action::Finish},
    Row{State::PlanningPass, Event::Planned, Guard::Always, State::PreparingScan, Action::BeginScan},
    Row{State::PlanningPass, Event::StepFailed, Guard::Always, State::Failed, Action::Finish},
    Row{State::PlanningPass, Event::Abort, Guard::Always, State::Failed, Action::Finish},
    Row{State::Uploading, Event::RobotDone, Guard::ArcAllowed, State::Welding, Action::Weld},
    Row{State::Uploading, Event::RobotDone, Guard::WeldNotWanted, State::Done, Action::Finish},
    Row{State::Uploading, Event::Abort, Guard::Always, State::Failed, Action::Finish},
    Row{State::Welding, Event::ProgramEnded, Guard::AllSeamsDone, State::Done, Action::Finish},
    Row{State::Welding, Event::Abort, Guard::Always, State::Failed, Action::Finish},
    Row{State::Done, Event::JobArrived, Guard::Always, State::Importing, Action::Import},
    Row{State::Done, Event::Reset, Guard::Always, State::Idle, Action::Clear},
    Row{State::Failed, Event::JobArrived, Guard::Always, State::Importing, Action::Import},
    Row{State::Failed, Event::Reset, Guard::Always, State::Idle, Action::Clear},
    Row{State::Faulted, Event::Resume, Guard::Always, State::Importing, Action::Recover},
    Row{State::Faulted, Event::Abort, Guard::Always, State::Failed, Action::Finish},
    Row{State::Interrupted, Event::Resume, Guard::Always, State::Importing, Action::Recover},
    Row{State::Interrupted, Event::Abort, Guard::Always, State::Failed, Action::Finish},
};

/// States that hold a job under way: a fault there keeps the job as Faulted.
constexpr bool under_way(State s) {
  return s != State::Idle && s != State::Done && s != State::Failed && s != State::Faulted &&
         s != State::Interrupted;
}

constexpr bool ended(State s) { return s == State::Done || s == State::Failed; }

const char* to_string(State);
const char* to_string(Event);
const char* to_string(Guard);
const char* to_string(Action);

/// The table as a Graphviz digraph: docs/job_states.dot is this text.
std::string states_dot();

namespace check {

constexpr bool no_row_shadowed() {
  for (std::size_t i = 0; i < kRows.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (kRows[i].from != kRows[j].from || kRows[i].event != kRows[j].event) continue;
      if (kRows[j].guard == Guard::Always || kRows[j].guard == kRows[i].guard) return false;
    }
  }
  return true;
}

constexpr bool every_state_reachable() {
  std::array<bool, kStates> seen{};
  seen[0] = true;
  seen[static_cast<std::size_t>(State::Faulted)] = true;  // by the fault reaction, from everywhere
  for (std::size_t round = 0; round < kStates; ++round) {
    for (const Row& row : kRows) {
      if (seen[static_cast<std::size_t>(row.from)]) seen[static_cast<std::size_t>(row.to)] = true;
    }
  }
  for (const bool s : seen) {
    if (!s) return false;
  }
  return true;
}

constexpr bool welding_only_through_arc_guard() {
  for (const Row& row : kRows) {
    if (row.to == State::Welding && row.guard != Guard::ArcAllowed) return false;
    if (row.action == Action::Weld && row.to != State::Welding) return false;
  }
  return true;
}

constexpr bool every_job_can_abort() {
  for (std::size_t s = 0; s < kStates; ++s) {
    const State state = static_cast<State>(s);
    if (state == State::Idle || state == State::Done || state == State::Failed) continue;
    bool aborts = false;
    for (const Row& row : kRows) aborts = aborts || (row.from == state && row.event == Event::Abort);
    if (!aborts) return false;
  }
  return true;
}

constexpr bool motion_only_from_a_person() {
  // Rows that first set the arm in motion hang on Start, Confirm or on a step that only these or Resume lead
  // to.
  for (const Row& row : kRows) {
    if (row.from == State::Idle || row.from == State::Done || row.from == State::Failed ||
        row.from == State::Faulted || row.from == State::Interrupted) {
      if (row.to != State::Importing && row.to != State::Interrupted && row.to != State::Idle &&
          row.to != State::Failed) {
        return false;
      }
    }
  }
  return true;
}

}  // namespace check

static_assert(check::no_row_shadowed());
static_assert(check::every_state_reachable());
static_assert(check::welding_only_through_arc_guard());
static_assert(check::every_job_can_abort());
static_assert(check::motion_only_from_a_person());

}  // namespace weldcell::job
