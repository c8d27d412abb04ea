#include "weldcell/job/state_table.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>

namespace weldcell::job {
namespace {

TEST(StateTable, IsWhatTheDocumentationShows) {
  std::ifstream in(std::string(WELDCELL_CONFIG) + "/../docs/job_states.dot");
  std::stringstream text;
  text << in.rdbuf();
  EXPECT_EQ(text.str(), states_dot()) << "write it anew: weldcelld --print-states > docs/job_states.dot";
}

TEST(StateTable, NamesEveryStateAndEventOnce) {
  std::set<std::string> names;
  for (std::size_t s = 0; s < kStates; ++s) names.insert(to_string(static_cast<State>(s)));
  EXPECT_EQ(names.size(), kStates);
}

// The events that may move the arm or weld, and the states in which they must be deaf.
TEST(StateTable, StartConfirmAndResumeAreDeniedEverywhereElse) {
  for (const Row& row : kRows) {
    if (row.event == Event::Start) {
      EXPECT_EQ(row.from, State::Ready);
    }
    if (row.event == Event::Confirm) {
      EXPECT_EQ(row.from, State::Placing);
    }
    if (row.event == Event::Resume) {
      EXPECT_TRUE(row.from == State::Faulted || row.from == State::Interrupted);
    }
  }
}

TEST(StateTable, EveryWayIntoMotionComesFromAPersonsOrder) {
  // Take away what a person gives: then no state with motion can be reached from a resting one.
  std::set<State> seen{State::Idle, State::Interrupted, State::Faulted, State::Done, State::Failed};
  for (std::size_t round = 0; round < kStates; ++round) {
    for (const Row& row : kRows) {
      const bool by_person =
          row.event == Event::Start || row.event == Event::Confirm || row.event == Event::Resume;
      const bool resuming = row.guard == Guard::ResumeAtGuide || row.guard == Guard::ResumeAtScan;
      if (!by_person && !resuming && seen.count(row.from) > 0) seen.insert(row.to);
    }
  }
  for (const State moving : {State::GuideMoving, State::PreparingScan, State::Scanning, State::Welding}) {
    EXPECT_EQ(seen.count(moving), 0u) << to_string(moving);
  }
}

}  // namespace
}  // namespace weldcell::job
