// The spool: jobs as files in incoming, active, done, failed, rejected; rename is the commit. Owned by one
// thread.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "weldcell/base/result.hpp"
#include "weldcell/base/time.hpp"

namespace weldcell::adapters {

struct SpoolOptions {
  Nanoseconds settle =
      300 * kMillisecond;  ///< an entry must stand still for so long, unless it was renamed into place
  Nanoseconds unclosed =
      60 * kSecond;  ///< a file whose writer never closed it counts as whole after so long without change
  Nanoseconds lone_folder = 10 * kSecond;  ///< a folder without a job file is waited for so long
  std::uintmax_t max_job_bytes = 1 << 20;
  std::uintmax_t max_file_bytes = 512ull << 20;  ///< of each CAD or workpiece file
};

/// A whole entry of incoming/: a job file, or a folder with one job file and what belongs to it.
struct SpoolEntry {
  std::string name;                ///< in incoming/: "demo.yaml" or "demo"
  std::filesystem::path job_file;  ///< absolute; parse this. Empty when `problem` is set and there is none
  bool folder = false;
  std::string
      problem;  ///< not "": it cannot be a job (link, no or two job files, not YAML, too large): reject it
  Nanoseconds waited = 0;  ///< since it was first whole
};

enum class SpoolPlace : std::uint8_t { Incoming, Active, Done, Failed, Rejected };
const char* to_string(SpoolPlace);

/// A job that was taken. Its folder keeps job file, CAD, record, result and report.
struct SpoolJob {
  std::string name;
  SpoolPlace place = SpoolPlace::Active;
  std::filesystem::path folder;    ///< absolute
  std::filesystem::path job_file;  ///< absolute, inside the folder; empty if it is gone
  std::string reason;              ///< of a rejected one
};

class SpoolDir {
 public:
  /// Makes the five folders (mode 0750) where they lack, ends a take() that a crash cut, and looks for what
  /// is there. Errors: "spool.permission", "spool.io".
  static Result<SpoolDir> open(const std::filesystem::path& root, const SpoolOptions& options = {});
  SpoolDir(SpoolDir&&) noexcept;
  SpoolDir& operator=(SpoolDir&&) noexcept;
  ~SpoolDir();

  /// Waits at most `timeout` for a change and returns the entries that became whole, oldest first; each is
  /// offered once. Hidden names and names that end in ~ .tmp .part .swp are left alone; so are CAD files
  /// (.step .stp .dxf), signatures (.minisig) and YAML that is a workpiece and no job: they wait for their
  /// job.
  std::vector<SpoolEntry> poll(Nanoseconds timeout);
  /// Offers the entry again when incoming/ changes, at the latest after a second (its CAD file has not come
  /// yet).
  void put_back(const SpoolEntry& entry);

  /// Moves the entry to active/<job_name>/ together with `files`, paths relative to the job file as the job
  /// names them. Either all of it or nothing happens. A file that another waiting job names too is copied.
  /// Errors: "spool.name" (not a plain name), "spool.duplicate" (a job of that name is active, done or
  /// failed), "spool.missing" (a file is not there yet), "spool.path" (absolute, "..", a link, not a plain
  /// file), "spool.size", "spool.io". None of them moves anything.
  Result<SpoolJob> take(const SpoolEntry& entry, const std::string& job_name,
                        std::span<const std::string> files);
  /// Moves the entry, with its signature, to rejected/ with its reason in <name>.reason beside it. A name
  /// that is taken there gets -2, -3, ...
  Status reject(const SpoolEntry& entry, const std::string& reason);
  /// Moves active/<name> to done/ or failed/. Errors: "spool.missing", "spool.io".
  Result<SpoolJob> finish(const std::string& name, SpoolPlace done_or_failed);

  /// Why incoming/ could not be looked through the last time (right lost, folder gone); nothing when it
  /// could.
  std::optional<Error> fault() const;
  /// Jobs in active/: right after open() these were interrupted by the end of the last process.
  std::vector<SpoolJob> active() const;
  /// Every job of the spool, place by place, by name.
  std::vector<SpoolJob> list() const;
  const std::filesystem::path& root() const;

 private:
  struct State;
  explicit SpoolDir(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// The name that a job's folder may have: 1..100 of A-Z a-z 0-9 . _ - and no leading dot.
bool is_job_name(std::string_view name);

/// Orders about a waiting job. They lie as empty files in <root>/.orders, so they outlive the daemon and can
/// be given while none runs.
enum class SpoolMark : std::uint8_t { Hold, Cancel };
/// Errors: "spool.name", "spool.permission", "spool.io". Marking twice is no error.
Status mark_job(const std::filesystem::path& root, SpoolMark mark, const std::string& job);
/// Takes the mark away; false when there was none.
bool unmark_job(const std::filesystem::path& root, SpoolMark mark, const std::string& job);
bool job_marked(const std::filesystem::path& root, SpoolMark mark, const std::string& job);
std::vector<std::string> marked_jobs(const std::filesystem::path& root, SpoolMark mark);

/// Drops a job and its files (each by path, kept under its file name) into <root>/incoming as one folder,
/// atomically; returns the folder. A signature beside the job file, JOB.yaml.minisig, goes along. The daemon
/// need not run. Errors: "submit.file" (missing, not a file), "submit.duplicate", "submit.spool".
Result<std::filesystem::path> submit_job(const std::filesystem::path& root,
                                         const std::filesystem::path& job_file,
                                         std::span<const std::filesystem::path> files);

}  // namespace weldcell::adapters
