// Hold and cancel as files in .orders/: made by whoever may write the spool, read by the daemon.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "spool_files.hpp"
#include "weldcell/adapters/fd.hpp"
#include "weldcell/adapters/spool_dir.hpp"

namespace weldcell::adapters {
namespace fs = std::filesystem;
namespace {

constexpr const char* kFolder = ".orders";

std::string prefix_of(SpoolMark mark) { return mark == SpoolMark::Hold ? "hold-" : "cancel-"; }

fs::path place_of(const fs::path& root, SpoolMark mark, const std::string& job) {
  return root / kFolder / (prefix_of(mark) + job);
}

}  // namespace

Status mark_job(const fs::path& root, SpoolMark mark, const std::string& job) {
  if (!is_job_name(job))
    return Error{"spool.name", job, "cannot be a job's name", "weldcell jobs lists the names"};
  const fs::path folder = root / kFolder, path = place_of(root, mark, job);
  ::mkdir(folder.c_str(), 0770);
  const Fd fd(::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0640));
  const int reason = fd.valid() ? 0 : errno;
  if (reason == EACCES || reason == EPERM || reason == EROFS)
    return Error{"spool.permission", path.string(), std::strerror(reason),
                 "join the group that owns the spool"};
  if (reason != 0) return Error{"spool.io", path.string(), std::strerror(reason), "name the right spool"};
  sync_folder(folder);
  return Done{};
}

bool unmark_job(const fs::path& root, SpoolMark mark, const std::string& job) {
  if (!is_job_name(job) || ::unlink(place_of(root, mark, job).c_str()) != 0) return false;
  sync_folder(root / kFolder);
  return true;
}

bool job_marked(const fs::path& root, SpoolMark mark, const std::string& job) {
  struct stat facts {};
  return is_job_name(job) && ::lstat(place_of(root, mark, job).c_str(), &facts) == 0;
}

std::vector<std::string> marked_jobs(const fs::path& root, SpoolMark mark) {
  const std::string prefix = prefix_of(mark);
  std::vector<std::string> out;
  std::error_code error;
  for (fs::directory_iterator it(root / kFolder, error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (name.starts_with(prefix)) out.push_back(name.substr(prefix.size()));
  }
  std::ranges::sort(out);
  return out;
}

}  // namespace weldcell::adapters
