#include "weldcell/job/state_table.hpp"

namespace weldcell::job {

const char* to_string(State s) {
  static constexpr std::array kNames{"Idle",        "Importing",    "Planning",      "Ready",
                                     "GuideMoving", "Placing",      "PreparingScan", "Scanning",
                                     "Localizing",  "PlanningPass", "Uploading",     "Welding",
                                     "Done",        "Failed",       "Faulted",       "Interrupted"};
  static_assert(kNames.size() == kStates);
  return kNames[static_cast<std::size_t>(s)];
}

const char* to_string(Event e) {
  static constexpr std::array kNames{
      "JobArrived", "JobFound",   "Imported", "Planned",      "StepFailed", "Start", "RobotDone", "Confirm",
      "EgmReady",   "MotionDone", "Solved",   "ProgramEnded", "Abort",      "Reset", "Resume",    "PutBack"};
  return kNames[static_cast<std::size_t>(e)];
}

const char* to_string(Guard g) {
  static constexpr std::array kNames{"Always",        "Guided",        "Unguided",      "MoreSteps",
                                     "LastStep",      "MorePasses",    "WeldCertified", "NotCertified",
                                     "ArcAllowed",    "WeldNotWanted", "AllSeamsDone",  "ResumeNowhere",
                                     "ResumeAtGuide", "ResumeAtScan"};
  return kNames[static_cast<std::size_t>(g)];
}

const char* to_string(Action a) {
  static constexpr std::array kNames{"None",      "Import",     "Plan",    "MoveToGuide", "ShowStep",
                                     "BeginScan", "FollowPlan", "Solve",   "PlanPass",    "Upload",
                                     "Weld",      "Finish",     "Recover", "Clear",       "PutBack"};
  return kNames[static_cast<std::size_t>(a)];
}

std::string states_dot() {
  std::string out =
      "// Printed by `weldcelld --print-states`; a test compares the two.\n"
      "digraph job {\n  rankdir=LR;\n  node [shape=box, style=rounded];\n";
  for (const Row& row : kRows) {
    out += std::string("  ") + to_string(row.from) + " -> " + to_string(row.to) + " [label=\"" +
           to_string(row.event);
    if (row.guard != Guard::Always) out += std::string(" [") + to_string(row.guard) + "]";
    if (row.action != Action::None) out += std::string(" / ") + to_string(row.action);
    out += "\"];\n";
  }
  out += "  // From every state with a job under way, a fault leads to Faulted.\n}\n";
  return out;
}

}  // namespace weldcell::job
