#include "spool_watch.hpp"

#include <poll.h>
#include <sys/inotify.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "weldcell/adapters/host_clock.hpp"

namespace weldcell::adapters {
namespace fs = std::filesystem;
namespace {

constexpr std::uint32_t kEvents =
    IN_CREATE | IN_MODIFY | IN_CLOSE_WRITE | IN_MOVED_TO | IN_MOVED_FROM | IN_DELETE | IN_ATTRIB | IN_ONLYDIR;
constexpr int kDeepestWatch = 4;
/// Looks even without an event, so that no lost event can lose a job.
constexpr Nanoseconds kLongestBlindness = 5 * kSecond;
constexpr Nanoseconds kRetry = kSecond;

std::string text_mb(std::uintmax_t bytes) { return std::to_string(bytes >> 20) + " MB"; }

/// The first thing inside that is no plain file or folder; empty when there is none.
std::string foreign_inside(const fs::path& folder) {
  std::error_code error;
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    const fs::file_status status = it->symlink_status(error);
    if (!fs::is_regular_file(status) && !fs::is_directory(status)) return it->path().filename().string();
  }
  return {};
}

}  // namespace

SpoolWatch::SpoolWatch(fs::path incoming, const SpoolOptions& options)
    : incoming_(std::move(incoming)), options_(options), inotify_(::inotify_init1(IN_NONBLOCK | IN_CLOEXEC)) {
  incoming_watch_ = ::inotify_add_watch(inotify_.get(), incoming_.c_str(), kEvents);
}

void SpoolWatch::put_back(const std::string& name) {
  const auto found = seen_.find(name);
  if (found == seen_.end()) return;
  found->second.offered = false;
  found->second.offer_from = now() + kRetry;
  look_again_ = std::min(look_again_, found->second.offer_from);
}

bool SpoolWatch::drain_events() {
  alignas(inotify_event) std::array<char, 16384> buffer;
  bool any = false;
  for (;;) {
    const ssize_t got = ::read(inotify_.get(), buffer.data(), buffer.size());
    if (got <= 0) return any;
    any = true;
    for (ssize_t at = 0; at < got;) {
      inotify_event event;
      std::memcpy(&event, buffer.data() + at, sizeof event);
      const char* name = buffer.data() + at + sizeof event;
      note_event(event.wd, event.mask, event.len == 0 ? std::string() : std::string(name));
      at += static_cast<ssize_t>(sizeof event + event.len);
    }
  }
}

void SpoolWatch::note_event(int watch, unsigned mask, const std::string& name) {
  if ((mask & IN_Q_OVERFLOW) != 0) {
    // Closings may be among what was lost; the marks still tell a growing file.
    for (auto& [entry, seen] : seen_) seen.unclosed.clear();
    return;
  }
  if ((mask & IN_IGNORED) != 0) {
    folders_.erase(watch);
    return;
  }
  const bool top = watch == incoming_watch_;
  const auto folder = folders_.find(watch);
  if (!top && folder == folders_.end()) return;
  const std::string entry = top ? name : folder->second.first;
  if (entry.empty() || is_passing_name(entry)) return;
  Seen& seen = seen_[entry];
  const std::string file = top ? name : (folder->second.second / name).string();
  if ((mask & IN_ISDIR) != 0) {
    if (top && (mask & IN_MOVED_TO) != 0) seen.renamed_in = true;
    if ((mask & (IN_CREATE | IN_MOVED_TO)) != 0)
      watch_folders(top ? incoming_ / name : folder->second.second / name, entry, top ? 0 : 1);
    return;
  }
  if ((mask & (IN_CREATE | IN_MODIFY)) != 0) {
    seen.unclosed.insert(file);
    seen.renamed_in = false;
  }
  if ((mask & (IN_CLOSE_WRITE | IN_MOVED_TO | IN_MOVED_FROM | IN_DELETE)) != 0) seen.unclosed.erase(file);
  if (top && (mask & IN_MOVED_TO) != 0) seen.renamed_in = true;
}

void SpoolWatch::watch_folders(const fs::path& folder, const std::string& entry, int depth) {
  const int watch = ::inotify_add_watch(inotify_.get(), folder.c_str(), kEvents | IN_DONT_FOLLOW);
  if (watch < 0) return;
  folders_[watch] = {entry, folder};
  if (depth >= kDeepestWatch) return;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    if (it->is_directory(error) && !it->is_symlink(error)) watch_folders(it->path(), entry, depth + 1);
  }
}

std::vector<SpoolEntry> SpoolWatch::poll(Nanoseconds timeout) {
  const HostTime deadline = now() + timeout;
  for (;;) {
    if (drain_events()) {
      dirty_ = true;
      for (auto& [name, seen] : seen_) seen.offer_from = HostTime{0};
    }
    const HostTime at = now();
    if (dirty_ || at >= look_again_) {
      dirty_ = false;
      std::vector<SpoolEntry> whole = scan(at);
      if (!whole.empty()) return whole;
    }
    if (at >= deadline) return {};
    const Nanoseconds wait = std::max<Nanoseconds>(std::min(deadline, look_again_) - at, kMillisecond);
    const std::timespec limit{wait / kSecond, wait % kSecond};
    pollfd wanted{inotify_.get(), POLLIN, 0};
    ::ppoll(&wanted, 1, &limit, nullptr);
  }
}

std::vector<SpoolEntry> SpoolWatch::scan(HostTime at) {
  look_again_ = at + kLongestBlindness;
  for (auto& [name, seen] : seen_) seen.present = false;
  std::vector<std::pair<std::int64_t, SpoolEntry>> whole;
  std::error_code error;
  for (fs::directory_iterator it(incoming_, error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (is_passing_name(name)) continue;
    Seen& seen = seen_[name];
    seen.present = true;
    const EntryMark mark = mark_of(it->path());
    if (mark != seen.mark) {
      const bool first = seen.mark == EntryMark{};
      seen.mark = mark;
      seen.changed = at;
      seen.offered = false;
      seen.first_whole = HostTime{0};
      if (!first) seen.renamed_in = false;
    }
    if (seen.offered) continue;
    Look look = look_at(name, seen, at);
    if (look.kind == Look::Kind::Companion) continue;
    const HostTime again = look.kind == Look::Kind::Whole ? seen.offer_from : look.look_again;
    if (look.kind == Look::Kind::Waiting || at < seen.offer_from) {
      look_again_ = std::min(look_again_, again);
      continue;
    }
    seen.offered = true;
    if (seen.first_whole == HostTime{0}) seen.first_whole = at;
    look.entry.waited = at - seen.first_whole;
    whole.emplace_back(mark.newest_ns, std::move(look.entry));
  }
  look_failure_ = error.value();
  // A look that failed proves nothing about what is gone.
  if (error) return {};
  std::erase_if(seen_, [](const auto& entry) { return !entry.second.present; });
  std::ranges::sort(whole, [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first < b.first : a.second.name < b.second.name;
  });
  std::vector<SpoolEntry> out;
  for (auto& [age, entry] : whole) out.push_back(std::move(entry));
  return out;
}

SpoolWatch::Look SpoolWatch::look_at(const std::string& name, Seen& seen, HostTime at) const {
  const fs::path path = incoming_ / name;
  struct stat facts {};
  Look out;
  out.kind = Look::Kind::Whole;
  if (::lstat(path.c_str(), &facts) != 0) {
    out.kind = Look::Kind::Companion;
  } else if (S_ISLNK(facts.st_mode)) {
    out.entry.problem = "is a link: drop the file itself";
  } else if (!S_ISREG(facts.st_mode) && !S_ISDIR(facts.st_mode)) {
    out.entry.problem = "is neither a file nor a folder";
  } else if (!seen.unclosed.empty() && at - seen.changed < options_.unclosed) {
    out = {Look::Kind::Waiting, seen.changed + options_.unclosed, {}};
  } else if (!seen.renamed_in && at - seen.changed < options_.settle) {
    out = {Look::Kind::Waiting, seen.changed + options_.settle, {}};
  } else {
    out = S_ISDIR(facts.st_mode) ? look_at_folder(path, seen, at) : look_at_file(path, seen, at);
  }
  out.entry.name = name;
  return out;
}

SpoolWatch::Look SpoolWatch::look_at_file(const fs::path& path, const Seen& seen, HostTime at) const {
  Look out;
  if (has_cad_name(path) || has_signature_name(path)) {
    out.kind = Look::Kind::Companion;
    return out;
  }
  out.kind = Look::Kind::Whole;
  std::error_code error;
  const std::uintmax_t bytes = fs::file_size(path, error);
  if (!has_yaml_name(path)) {
    out.entry.problem = "is no job: a job is a .yaml file, its workpiece .yaml, .step, .stp or .dxf";
  } else if (bytes > options_.max_job_bytes) {
    out.entry.problem = "is larger than " + text_mb(options_.max_job_bytes) + ": that is no job file";
  } else if (bytes == 0 && at - seen.changed < options_.lone_folder) {
    out.kind = Look::Kind::Waiting;
    out.look_again = seen.changed + options_.lone_folder;
  } else if (yaml_kind(read_text(path, options_.max_job_bytes)) == YamlKind::Workpiece) {
    out.kind = Look::Kind::Companion;
  } else {
    out.entry.job_file = path;
  }
  return out;
}

SpoolWatch::Look SpoolWatch::look_at_folder(const fs::path& path, const Seen& seen, HostTime at) const {
  Look out;
  out.kind = Look::Kind::Whole;
  out.entry.folder = true;
  if (const std::string foreign = foreign_inside(path); !foreign.empty()) {
    out.entry.problem = "holds '" + foreign + "', which is no plain file: drop the files themselves";
    return out;
  }
  const std::vector<fs::path> jobs = job_files_in(path, options_.max_job_bytes);
  if (jobs.size() == 1) {
    out.entry.job_file = jobs.front();
  } else if (!jobs.empty()) {
    out.entry.problem = "holds " + std::to_string(jobs.size()) + " job files: drop one folder a job";
  } else if (at - seen.changed < options_.lone_folder) {
    out.kind = Look::Kind::Waiting;
    out.look_again = seen.changed + options_.lone_folder;
  } else {
    out.entry.problem = "holds no job file (.yaml with the key 'job')";
  }
  return out;
}

}  // namespace weldcell::adapters
