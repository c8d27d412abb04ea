// Takes jobs from the spool when the cell is free, rejects what cannot be a job, and puts ended jobs where
// they belong. Main thread.
#pragma once

#include <deque>
#include <map>
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
  /// A job of incoming/, or one of active/ that was not begun and gave way to another.
  struct Waiting {
    adapters::SpoolEntry entry;              ///< of incoming/
    std::shared_ptr<const ActiveJob> taken;  ///< of active/
    std::string job;
    int number = 0, priority = 0;
  };

  void find_interrupted();
  void offer(adapters::SpoolEntry entry);
  void take_back();
  void obey_cancels(HostTime now);
  bool cancel(const std::string& job);
  /// The next job by the PLC's choice, priority and age; end() when none may come.
  std::deque<Waiting>::iterator next();
  bool held(const Waiting& waiting) const;
  void take(const Waiting& waiting);
  bool hand_over(std::shared_ptr<const ActiveJob> job);
  void refuse(const adapters::SpoolEntry& entry, const Error& fault);
  void reject(const adapters::SpoolEntry& entry, const std::string& reason);
  void count_waiting();
  /// Says once what hinders the spool; "" when nothing does any more.
  void tell(const std::string& fault);

  Wiring& wiring_;
  adapters::SpoolDir spool_;
  std::deque<Waiting> waiting_;
  std::deque<std::shared_ptr<const ActiveJob>> interrupted_;
  std::map<std::string, HostTime> cancels_;  ///< when an order to cancel was first seen
  bool handed_over_ = false;
  std::string told_;
};

}  // namespace weldcell::app
