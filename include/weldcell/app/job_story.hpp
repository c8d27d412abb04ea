// What happened in a job, gathered from the cell's outputs: events, drawings, times; and the result and
// report made of it.
#pragma once

#include <string>
#include <vector>

#include "weldcell/app/egm_watch.hpp"
#include "weldcell/job/cell.hpp"
#include "weldcell/review/report.hpp"

namespace weldcell::app {

class JobStory {
 public:
  /// Gathers the outputs of one step; call it for every step of the job, the first with JobArrived.
  void note(HostTime time, const job::Outputs& outputs);
  /// An input of the job: EGM cycles are watched, the rest is left alone.
  void note_input(const job::Input& input);
  /// The solver's time on the host; not part of what replay compares.
  void note_solve_time(double seconds) { solve_s_ = seconds; }

  const std::optional<job::FinishJob>& end() const { return end_; }
  double scan_s() const { return scan_s_; }
  double solve_s() const { return solve_s_; }

  /// The page's content, from the cell as it stands after the job's last step.
  review::ReportInput report(const job::Cell& cell, const cell::CellSetup& setup,
                             const std::string& program_version, const std::string& accepted_at) const;
  /// result.json of the job's folder: verdict, pose, welds, figures (docs/FORMATS.md).
  std::string result_json(const job::Cell& cell) const;

 private:
  HostTime begin_;
  bool begun_ = false;
  std::vector<review::ReportEvent> events_;
  std::vector<std::shared_ptr<const guidance::Drawing>> drawings_;
  std::vector<plan::ScanPass> passes_;
  EgmWatch egm_;
  double scan_s_ = 0, solve_s_ = 0;
  std::optional<job::FinishJob> end_;
};

}  // namespace weldcell::app
