// Runs a record again through the same code and compares every output and every answer with what was
// recorded. One thread.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "weldcell/app/job_story.hpp"
#include "weldcell/app/record.hpp"

namespace weldcell::app {

/// KEY=VALUE of `weldcell replay --set`: a dotted key of the cell file ("laser.latency_ms") or, behind
/// "job.", of the job.
struct Change {
  std::string key, value;
};

struct ReplayOutcome {
  std::size_t steps = 0, solves = 0;
  std::vector<Error> differences;   ///< first one first; `where` names sequence number and byte
  std::unique_ptr<job::Cell> cell;  ///< after the last step
  cell::CellSetup setup;
  wire::LaserFormat laser_format;
  JobStory story;
  std::string recorded_solve, new_solve;  ///< marks of the last solve, JSON
};

/// Error when the record lacks what a replay needs. With changes nothing is compared: 'what if'.
Result<ReplayOutcome> replay(const Record& record, const std::vector<Change>& changes);

}  // namespace weldcell::app
