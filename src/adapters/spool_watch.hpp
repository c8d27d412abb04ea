// Watches incoming/: which entries are whole, and which of them can be jobs. Private to the spool.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "spool_files.hpp"
#include "weldcell/adapters/fd.hpp"
#include "weldcell/adapters/spool_dir.hpp"

namespace weldcell::adapters {

class SpoolWatch {
 public:
  SpoolWatch(std::filesystem::path incoming, const SpoolOptions& options);

  std::vector<SpoolEntry> poll(Nanoseconds timeout);
  void put_back(const std::string& name);
  void forget(const std::string& name) { seen_.erase(name); }
  /// errno of the last look at incoming/, 0 when it went well.
  int look_failure() const { return look_failure_; }

 private:
  struct Seen {
    EntryMark mark;
    HostTime changed;  ///< when the mark last changed
    HostTime first_whole{0};
    HostTime offer_from{0};   ///< put_back() delays the next offer
    bool renamed_in = false;  ///< whole from its first moment
    bool offered = false;
    bool present = false;
    std::set<std::string> unclosed;  ///< files with a writer
  };
  /// What is known of an entry now: nothing yet, a companion that waits for its job, a job, or a problem.
  struct Look {
    enum class Kind { Waiting, Companion, Whole } kind = Kind::Waiting;
    HostTime look_again{0};
    SpoolEntry entry;
  };

  bool drain_events();
  void note_event(int watch, unsigned mask, const std::string& name);
  void watch_folders(const std::filesystem::path& folder, const std::string& entry, int depth);
  std::vector<SpoolEntry> scan(HostTime at);
  Look look_at(const std::string& name, Seen& seen, HostTime at) const;
  Look look_at_file(const std::filesystem::path& path, const Seen& seen, HostTime at) const;
  Look look_at_folder(const std::filesystem::path& path, const Seen& seen, HostTime at) const;

  std::filesystem::path incoming_;
  SpoolOptions options_;
  Fd inotify_;
  int incoming_watch_ = -1;
  std::map<int, std::pair<std::string, std::filesystem::path>> folders_;  ///< watch -> entry, folder
  std::map<std::string, Seen> seen_;
  HostTime look_again_{0};
  bool dirty_ = true;
  int look_failure_ = 0;
};

}  // namespace weldcell::adapters
