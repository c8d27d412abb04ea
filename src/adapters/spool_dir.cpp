#include "weldcell/adapters/spool_dir.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "spool_files.hpp"
#include "spool_watch.hpp"

namespace weldcell::adapters {
namespace fs = std::filesystem;
namespace {

constexpr SpoolPlace kPlaces[] = {SpoolPlace::Incoming, SpoolPlace::Active, SpoolPlace::Done,
                                  SpoolPlace::Failed, SpoolPlace::Rejected};
constexpr const char* kTakePrefix = ".take-";
/// Names the job's file inside its folder; written before the job file is moved, so a cut take() can be
/// ended.
constexpr const char* kJobMark = ".job";
constexpr std::size_t kMostNameBytes = 255;

Error io_fault(const fs::path& where, int reason) {
  const bool denied = reason == EACCES || reason == EPERM || reason == EROFS;
  return {denied ? "spool.permission" : "spool.io", where.string(), std::strerror(reason),
          denied             ? "give the daemon's user the right to write the spool and what is dropped there"
          : reason == ENOSPC ? "free space on the spool's disk"
                             : "check the spool's disk"};
}

bool stands(const fs::path& path) {
  struct stat facts {};
  return ::lstat(path.c_str(), &facts) == 0;
}

std::optional<Error> make_folder(const fs::path& path) {
  if (::mkdir(path.c_str(), 0750) == 0) return std::nullopt;
  const int reason = errno;
  struct stat facts {};
  if (reason == EEXIST && ::lstat(path.c_str(), &facts) == 0 && S_ISDIR(facts.st_mode)) {
    if (::access(path.c_str(), R_OK | W_OK | X_OK) == 0) return std::nullopt;
    return io_fault(path, errno);
  }
  if (reason == EEXIST) return Error{"spool.io", path.string(), "is no folder", "move it away"};
  return io_fault(path, reason);
}

fs::path job_file_of(const fs::path& folder, std::size_t max_job_bytes) {
  const std::string marked = read_text(folder / kJobMark, kMostNameBytes);
  if (!marked.empty() && marked.find('/') == std::string::npos && stands(folder / marked))
    return folder / marked;
  const std::vector<fs::path> jobs = job_files_in(folder, max_job_bytes);
  return jobs.size() == 1 ? jobs.front() : fs::path();
}

}  // namespace

const char* to_string(SpoolPlace place) {
  switch (place) {
    case SpoolPlace::Incoming:
      return "incoming";
    case SpoolPlace::Active:
      return "active";
    case SpoolPlace::Done:
      return "done";
    case SpoolPlace::Failed:
      return "failed";
    case SpoolPlace::Rejected:
      break;
  }
  return "rejected";
}

bool is_job_name(std::string_view name) {
  return !name.empty() && name.size() <= 100 && name.front() != '.' && std::ranges::all_of(name, [](char c) {
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '_' || c == '-';
  });
}

struct SpoolDir::State {
  State(const fs::path& root_path, const SpoolOptions& o)
      : root(root_path), options(o), watch(root_path / to_string(SpoolPlace::Incoming), o) {}
  fs::path place(SpoolPlace p) const { return root / to_string(p); }

  void end_cut_takes();
  Result<std::vector<fs::path>> check_files(const SpoolEntry& entry,
                                            std::span<const std::string> files) const;
  int stage(const SpoolEntry& entry, const fs::path& staging, std::span<const std::string> files) const;
  void drop_taken_files(std::span<const std::string> files) const;

  fs::path root;
  SpoolOptions options;
  SpoolWatch watch;
};

SpoolDir::SpoolDir(std::unique_ptr<State> state) : state_(std::move(state)) {}
SpoolDir::SpoolDir(SpoolDir&&) noexcept = default;
SpoolDir& SpoolDir::operator=(SpoolDir&&) noexcept = default;
SpoolDir::~SpoolDir() = default;
const fs::path& SpoolDir::root() const { return state_->root; }
std::vector<SpoolEntry> SpoolDir::poll(Nanoseconds timeout) { return state_->watch.poll(timeout); }
void SpoolDir::put_back(const SpoolEntry& entry) { state_->watch.put_back(entry.name); }

std::optional<Error> SpoolDir::fault() const {
  const int reason = state_->watch.look_failure();
  if (reason == 0) return std::nullopt;
  return io_fault(state_->place(SpoolPlace::Incoming), reason);
}

Result<SpoolDir> SpoolDir::open(const fs::path& root, const SpoolOptions& options) {
  std::error_code error;
  fs::create_directories(root.parent_path(), error);
  if (auto fault = make_folder(root)) return *fault;
  const fs::path absolute = fs::canonical(root, error);
  if (error) return io_fault(root, error.value());
  for (const SpoolPlace place : kPlaces) {
    if (auto fault = make_folder(absolute / to_string(place))) return *fault;
  }
  auto state = std::make_unique<State>(absolute, options);
  state->end_cut_takes();
  return SpoolDir(std::move(state));
}

void SpoolDir::State::end_cut_takes() {
  std::error_code error;
  std::vector<fs::path> cut;
  for (fs::directory_iterator it(place(SpoolPlace::Active), error), end; !error && it != end;
       it.increment(error)) {
    if (it->path().filename().string().starts_with(kTakePrefix)) cut.push_back(it->path());
  }
  for (const fs::path& staging : cut) {
    const std::string marked = read_text(staging / kJobMark, kMostNameBytes);
    const std::string name = staging.filename().string().substr(std::strlen(kTakePrefix));
    if (!marked.empty() && stands(staging / marked))
      rename_fresh(staging, place(SpoolPlace::Active) / name);
    else
      // Copies only: the job file and its originals are still in incoming/.
      fs::remove_all(staging, error);
  }
  sync_folder(place(SpoolPlace::Active));
}

Result<std::vector<fs::path>> SpoolDir::State::check_files(const SpoolEntry& entry,
                                                           std::span<const std::string> files) const {
  std::vector<fs::path> out;
  for (const std::string& name : files) {
    if (!entry.folder && name.find('/') != std::string::npos)
      return Error{"spool.path", name, "is not right beside the job file",
                   "drop the job as a folder with everything in it"};
    auto path = plain_file_below(entry.job_file.parent_path(), name);
    if (!path.ok()) return path.error();
    if (*path == entry.job_file)
      return Error{"spool.path", name, "is the job file itself", "name the workpiece file"};
    std::error_code error;
    if (fs::file_size(*path, error) > options.max_file_bytes)
      return Error{"spool.size", name,
                   "is larger than " + std::to_string(options.max_file_bytes >> 20) + " MB",
                   "export the part without what the weld does not need"};
    out.push_back(std::move(*path));
  }
  return out;
}

int SpoolDir::State::stage(const SpoolEntry& entry, const fs::path& staging,
                           std::span<const std::string> files) const {
  const fs::path incoming = place(SpoolPlace::Incoming);
  if (::mkdir(staging.c_str(), 0750) != 0) return errno;
  for (const std::string& name : files) {
    if (const int reason = copy_file_durably(incoming / name, staging / name); reason != 0) return reason;
  }
  if (const int reason = write_text_durably(staging / kJobMark, entry.name); reason != 0) return reason;
  sync_folder(staging);
  if (const int reason = rename_fresh(incoming / entry.name, staging / entry.name); reason != 0)
    return reason;
  sync_folder(staging);
  sync_folder(incoming);
  return 0;
}

/// Removes from incoming/ what was copied into the job, unless another waiting file speaks of it.
void SpoolDir::State::drop_taken_files(std::span<const std::string> files) const {
  const fs::path incoming = place(SpoolPlace::Incoming);
  std::error_code error;
  std::string others;
  for (fs::directory_iterator it(incoming, error), end; !error && it != end; it.increment(error)) {
    if (has_yaml_name(it->path())) others += read_text(it->path(), options.max_job_bytes) + "\n";
  }
  for (const std::string& name : files) {
    if (others.find(name) == std::string::npos) ::unlink((incoming / name).c_str());
  }
}

Result<SpoolJob> SpoolDir::take(const SpoolEntry& entry, const std::string& job_name,
                                std::span<const std::string> files) {
  State& s = *state_;
  if (!is_job_name(job_name))
    return Error{"spool.name", entry.name, "'" + job_name + "' cannot be a job's name",
                 "use 1 to 100 of A-Z a-z 0-9 . _ - and no leading dot"};
  for (const SpoolPlace place : {SpoolPlace::Active, SpoolPlace::Done, SpoolPlace::Failed}) {
    if (stands(s.place(place) / job_name))
      return Error{"spool.duplicate", entry.name,
                   "job '" + job_name + "' is " + to_string(place) + " already",
                   "give the job another name in its key 'job'; a job is never run twice"};
  }
  const fs::path source = s.place(SpoolPlace::Incoming) / entry.name;
  const fs::path target = s.place(SpoolPlace::Active) / job_name;
  if (entry.name.find('/') != std::string::npos || entry.job_file.empty() || !stands(entry.job_file))
    return Error{"spool.missing", entry.name, "the job is no longer in incoming/", "drop it again"};
  const auto checked = s.check_files(entry, files);
  if (!checked.ok()) return checked.error();

  int reason = 0;
  if (entry.folder) {
    reason = rename_fresh(source, target);
  } else {
    std::vector<std::string> once(files.begin(), files.end());
    std::ranges::sort(once);
    once.erase(std::ranges::unique(once).begin(), once.end());
    const fs::path staging = s.place(SpoolPlace::Active) / (kTakePrefix + job_name);
    reason = s.stage(entry, staging, once);
    std::error_code error;
    if (reason != 0 && stands(source)) fs::remove_all(staging, error);
    if (reason == 0) reason = rename_fresh(staging, target);
    if (reason == 0) s.drop_taken_files(once);
  }
  if (reason != 0) return io_fault(source, reason);
  sync_folder(s.place(SpoolPlace::Active));
  sync_folder(s.place(SpoolPlace::Incoming));
  s.watch.forget(entry.name);
  return SpoolJob{job_name, SpoolPlace::Active, target, target / entry.job_file.filename(), ""};
}

Status SpoolDir::reject(const SpoolEntry& entry, const std::string& reason) {
  State& s = *state_;
  const fs::path source = s.place(SpoolPlace::Incoming) / entry.name;
  if (entry.name.empty() || entry.name.find('/') != std::string::npos || !stands(source))
    return Error{"spool.missing", entry.name, "is no longer in incoming/", ""};
  const fs::path rejected = s.place(SpoolPlace::Rejected);
  const fs::path name(entry.name);
  const std::string extension = entry.folder ? "" : name.extension().string();
  const std::string stem = entry.folder ? entry.name : name.stem().string();
  const std::string fresh =
      free_name(rejected, stem, {extension, extension + ".reason", extension + ".minisig"}) + extension;
  int failed = write_text_durably(rejected / (fresh + ".reason"), entry.name + ": " + reason + "\n");
  if (failed == 0) failed = rename_fresh(source, rejected / fresh);
  if (failed != 0) return io_fault(source, failed);
  // Left behind it would be held against the next job of that name.
  if (!entry.folder) rename_fresh(source.string() + ".minisig", rejected / (fresh + ".minisig"));
  sync_folder(rejected);
  sync_folder(s.place(SpoolPlace::Incoming));
  s.watch.forget(entry.name);
  return Done{};
}

Result<SpoolJob> SpoolDir::finish(const std::string& name, SpoolPlace done_or_failed) {
  State& s = *state_;
  const fs::path source = s.place(SpoolPlace::Active) / name;
  if (!is_job_name(name) || !stands(source)) return Error{"spool.missing", name, "is not active", ""};
  const SpoolPlace to = done_or_failed == SpoolPlace::Done ? SpoolPlace::Done : SpoolPlace::Failed;
  const fs::path target = s.place(to) / free_name(s.place(to), name, {""});
  if (const int reason = rename_fresh(source, target); reason != 0) return io_fault(source, reason);
  sync_folder(s.place(to));
  sync_folder(s.place(SpoolPlace::Active));
  return SpoolJob{target.filename().string(), to, target, job_file_of(target, s.options.max_job_bytes), ""};
}

std::vector<SpoolJob> SpoolDir::active() const {
  std::vector<SpoolJob> out = list();
  std::erase_if(out, [](const SpoolJob& job) { return job.place != SpoolPlace::Active; });
  return out;
}

std::vector<SpoolJob> SpoolDir::list() const {
  const State& s = *state_;
  std::vector<SpoolJob> out;
  for (const SpoolPlace place : kPlaces) {
    std::vector<fs::path> paths;
    std::error_code error;
    for (fs::directory_iterator it(s.place(place), error), end; !error && it != end; it.increment(error)) {
      const std::string name = it->path().filename().string();
      if (!is_passing_name(name) &&
          !(place == SpoolPlace::Rejected && (name.ends_with(".reason") || has_signature_name(name))))
        paths.push_back(it->path());
    }
    std::ranges::sort(paths);
    for (const fs::path& path : paths) {
      const bool folder = fs::is_directory(fs::symlink_status(path, error));
      const bool job = folder || (has_yaml_name(path) &&
                                  yaml_kind(read_text(path, s.options.max_job_bytes)) != YamlKind::Workpiece);
      if (!job && place == SpoolPlace::Incoming) continue;
      SpoolJob one;
      one.place = place;
      one.name = folder ? path.filename().string() : path.stem().string();
      one.folder = folder ? path : path.parent_path();
      one.job_file = folder ? job_file_of(path, s.options.max_job_bytes) : path;
      if (place == SpoolPlace::Rejected)
        one.reason = read_text(path.string() + ".reason", s.options.max_job_bytes);
      while (!one.reason.empty() && one.reason.back() == '\n') one.reason.pop_back();
      out.push_back(std::move(one));
    }
  }
  return out;
}

}  // namespace weldcell::adapters
