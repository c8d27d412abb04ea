// The cell thread: drains the rings, steps the brain, carries out what it says, and writes the record.
// Ordinary priority.
#pragma once

#include <fstream>
#include <memory>

#include "app/wiring.hpp"
#include "weldcell/adapters/journal_file.hpp"
#include "weldcell/app/egm_watch.hpp"
#include "weldcell/app/job_story.hpp"
#include "weldcell/app/record.hpp"

namespace weldcell::app {

class CellThread {
 public:
  CellThread(Wiring& wiring, std::string arm_yaml);
  /// Until wiring.stopping; then closes the record.
  void run();

 private:
  void drain();
  void feed(HostTime time, job::InputBody body);
  void watch(const job::EgmCycle& cycle);
  void dispatch(const job::Outputs& outputs);
  void dispatch(const job::Output& output);
  void begin_job(const std::shared_ptr<const ActiveJob>& job);
  void end_job(const job::FinishJob& finish);
  void close_record();
  void save(const job::SaveState& state);
  void order_import();

  Wiring& wiring_;
  std::string arm_yaml_;
  job::Cell cell_;
  EgmWatch egm_;
  std::shared_ptr<const ActiveJob> active_;
  std::shared_ptr<adapters::JournalFile> journal_;
  std::unique_ptr<RecordWriter> record_;
  std::shared_ptr<JobStory> story_;
  std::string accepted_at_;
  std::string unsaved_;  ///< why the state of this step is not durable; empty when it is
  std::vector<std::shared_ptr<const plan::MotionPlan>> plans_;
  std::uint64_t laser_lost_ = 0, egm_lost_ = 0;
  HostTime last_tick_, solve_asked_;
};

}  // namespace weldcell::app
