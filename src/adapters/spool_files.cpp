#include "spool_files.hpp"

#include <fcntl.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "weldcell/adapters/fd.hpp"

namespace weldcell::adapters {
namespace fs = std::filesystem;
namespace {

constexpr int kDeepestFolder = 8;
constexpr int kMostEntries = 10'000;

bool write_all(int fd, const char* data, std::size_t bytes) noexcept {
  while (bytes != 0) {
    const ssize_t written = ::write(fd, data, bytes);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    data += written;
    bytes -= static_cast<std::size_t>(written);
  }
  return true;
}

Error path_fault(const std::string& relative, const char* what) {
  return {"spool.path", relative, what, "name a plain file beside the job file"};
}

void mix(EntryMark& mark, std::uint64_t value) {
  mark.hash ^= value + 0x9E3779B97F4A7C15u + (mark.hash << 6) + (mark.hash >> 2);
}

void add_to_mark(EntryMark& mark, const fs::path& path, int depth, int& entries) {
  struct stat facts {};
  if (++entries > kMostEntries || ::lstat(path.c_str(), &facts) != 0) return;
  const std::int64_t changed = facts.st_mtim.tv_sec * 1'000'000'000 + facts.st_mtim.tv_nsec;
  mix(mark, static_cast<std::uint64_t>(facts.st_ino));
  mix(mark, static_cast<std::uint64_t>(facts.st_size));
  mix(mark, static_cast<std::uint64_t>(changed));
  mark.newest_ns = std::max(mark.newest_ns, changed);
  if (!S_ISDIR(facts.st_mode) || depth >= kDeepestFolder) return;
  std::error_code error;
  std::vector<fs::path> inside;
  for (fs::directory_iterator it(path, error), end; !error && it != end; it.increment(error))
    inside.push_back(it->path());
  std::ranges::sort(inside);
  for (const fs::path& one : inside) add_to_mark(mark, one, depth + 1, entries);
}

}  // namespace

int rename_fresh(const fs::path& from, const fs::path& to) noexcept {
  return ::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0 ? 0 : errno;
}

void sync_folder(const fs::path& folder) noexcept {
  const Fd fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (fd.valid()) ::fsync(fd.get());
}

int copy_file_durably(const fs::path& from, const fs::path& to) noexcept {
  const Fd in(::open(from.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC));
  if (!in.valid()) return errno;
  const Fd out(::open(to.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0640));
  if (!out.valid()) return errno;
  std::array<char, 65536> piece;
  for (;;) {
    const ssize_t got = ::read(in.get(), piece.data(), piece.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return errno;
    if (got == 0) break;
    if (!write_all(out.get(), piece.data(), static_cast<std::size_t>(got))) return errno;
  }
  return ::fsync(out.get()) == 0 ? 0 : errno;
}

int write_text_durably(const fs::path& path, std::string_view text, unsigned mode) noexcept {
  const Fd out(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode));
  if (!out.valid() || !write_all(out.get(), text.data(), text.size()) || ::fsync(out.get()) != 0)
    return errno;
  return 0;
}

std::string read_text(const fs::path& path, std::size_t limit) {
  // O_NONBLOCK: a fifo of this name must not hold the thread.
  const Fd in(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK));
  struct stat facts {};
  if (!in.valid() || ::fstat(in.get(), &facts) != 0 || !S_ISREG(facts.st_mode)) return {};
  std::string out(std::min(limit, static_cast<std::size_t>(facts.st_size)), '\0');
  std::size_t filled = 0;
  while (filled < out.size()) {
    const ssize_t got = ::read(in.get(), out.data() + filled, out.size() - filled);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    filled += static_cast<std::size_t>(got);
  }
  out.resize(filled);
  return out;
}

Result<fs::path> plain_file_below(const fs::path& folder, const std::string& relative) {
  const fs::path path(relative);
  if (relative.empty() || path.is_absolute())
    return path_fault(relative, "is no path relative to the job file");
  fs::path at = folder;
  for (auto step = path.begin(); step != path.end(); ++step) {
    if (*step == "." || step->empty()) continue;
    if (*step == "..") return path_fault(relative, "leads out of the spool");
    at /= *step;
    struct stat facts {};
    if (::lstat(at.c_str(), &facts) != 0)
      return Error{"spool.missing", relative, "the file is not beside the job",
                   "drop it first, or the job as a folder with everything in it"};
    if (S_ISLNK(facts.st_mode)) return path_fault(relative, "is a link or lies behind one");
    const bool last = std::next(step) == path.end();
    if (last ? !S_ISREG(facts.st_mode) : !S_ISDIR(facts.st_mode))
      return path_fault(relative, "is no plain file");
  }
  return at;
}

std::string free_name(const fs::path& folder, const std::string& stem,
                      const std::vector<std::string>& suffixes) {
  for (int n = 1;; ++n) {
    const std::string name = n == 1 ? stem : stem + "-" + std::to_string(n);
    const bool taken = std::ranges::any_of(suffixes, [&](const std::string& suffix) {
      struct stat facts {};
      return ::lstat((folder / (name + suffix)).c_str(), &facts) == 0;
    });
    if (!taken) return name;
  }
}

EntryMark mark_of(const fs::path& path) {
  EntryMark mark;
  int entries = 0;
  add_to_mark(mark, path, 0, entries);
  return mark;
}

YamlKind yaml_kind(std::string_view text) {
  bool workpiece = false;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const auto key = [&](std::string_view name) {
      return line.starts_with(name) && line.size() > name.size() && line[name.size()] == ':';
    };
    if (key("job") || key("\"job\"") || key("'job'")) return YamlKind::Job;
    // With its value on the same line, "workpiece: ladder.yaml" is a job's reference.
    if (key("workpiece")) {
      const std::size_t value = line.find_first_not_of(" \t\r", std::string_view("workpiece:").size());
      workpiece = value == std::string_view::npos || line[value] == '#' || line[value] == '{';
    }
  }
  return workpiece ? YamlKind::Workpiece : YamlKind::Other;
}

std::vector<fs::path> job_files_in(const fs::path& folder, std::size_t max_job_bytes) {
  std::vector<fs::path> jobs, others;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    if (!has_yaml_name(it->path()) || is_passing_name(it->path().filename().string())) continue;
    switch (yaml_kind(read_text(it->path(), max_job_bytes))) {
      case YamlKind::Job:
        jobs.push_back(it->path());
        break;
      case YamlKind::Other:
        others.push_back(it->path());
        break;
      case YamlKind::Workpiece:
        break;
    }
  }
  return jobs.empty() ? others : jobs;
}

bool has_yaml_name(const fs::path& path) {
  const std::string extension = path.extension().string();
  return extension == ".yaml" || extension == ".yml";
}

bool has_cad_name(const fs::path& path) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  return extension == ".step" || extension == ".stp" || extension == ".dxf";
}

bool has_signature_name(const fs::path& path) { return path.extension() == ".minisig"; }

bool is_passing_name(const std::string& name) {
  return name.empty() || name.front() == '.' || name.ends_with('~') || name.ends_with(".tmp") ||
         name.ends_with(".part") || name.ends_with(".swp") || name.ends_with(".filepart");
}

}  // namespace weldcell::adapters
