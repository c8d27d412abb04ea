// Takes jobs from the spool when the cell is free, rejects what cannot be a job, and puts ended jobs where
// they belong. Main thread.
#pragma once

#include <deque>
#include <memory>

#include "app/wiring.hpp"
#include "weldcell/adapters/spool_dir.hpp"

namespace weldcell::app {

class SpoolKeeper {
 public:
  SpoolKeeper(Wiring& wiring, adapters::SpoolDir spool);
  /// One round: waits at most `timeout` for the spool.
  void step(Nanoseconds timeout);
  /// Moves what has ended; also the last act before the daemon ends.
  void put_away();

 private:
  void find_interrupted();
  void look_at(const adapters::SpoolEntry& entry);
  bool hand_over(std::shared_ptr<const ActiveJob> job);
  void reject(const adapters::SpoolEntry& entry, const std::string& reason);

  Wiring& wiring_;
  adapters::SpoolDir spool_;
  std::deque<adapters::SpoolEntry> waiting_;
  std::deque<std::shared_ptr<const ActiveJob>> interrupted_;
  bool handed_over_ = false;
};

}  // namespace weldcell::app
