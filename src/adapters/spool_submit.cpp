#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>

#include "spool_files.hpp"
#include "weldcell/adapters/spool_dir.hpp"

namespace weldcell::adapters {
namespace fs = std::filesystem;
namespace {

Error file_fault(const fs::path& path, const std::string& what) {
  return {"submit.file", path.string(), what, "name the job file and the files that it refers to"};
}

/// What is dropped belongs to the spool's group, which may read and move it: the daemon is another user. Who
/// is not in that group and not root cannot write the spool anyhow.
void share(const fs::path& path, mode_t mode, gid_t group) {
  [[maybe_unused]] const int left = ::chown(path.c_str(), static_cast<uid_t>(-1), group);
  ::chmod(path.c_str(), mode);
}

std::optional<Error> fill(const fs::path& staging, const std::map<std::string, fs::path>& sources,
                          gid_t group) {
  for (const auto& [name, source] : sources) {
    const fs::path target = staging / name;
    if (const int reason = copy_file_durably(source, target); reason != 0)
      return Error{"submit.spool", target.string(), std::strerror(reason),
                   "check the spool's rights and its disk"};
    share(target, 0660, group);
  }
  sync_folder(staging);
  return std::nullopt;
}

}  // namespace

Result<fs::path> submit_job(const fs::path& root, const fs::path& job_file, std::span<const fs::path> files) {
  std::map<std::string, fs::path> sources;
  std::error_code error;
  std::vector<fs::path> all{job_file};
  all.insert(all.end(), files.begin(), files.end());
  const fs::path signature = job_file.string() + ".minisig";
  if (fs::exists(signature, error) && std::ranges::find(files, signature) == files.end())
    all.push_back(signature);
  for (const fs::path& path : all) {
    const fs::path real = fs::canonical(path, error);
    if (error) return file_fault(path, error.message());
    if (!fs::is_regular_file(real, error)) return file_fault(path, "is no plain file");
    if (!sources.emplace(path.filename().string(), real).second)
      return file_fault(path, "two files have this name");
  }
  if (!has_yaml_name(job_file)) return file_fault(job_file, "a job file's name ends in .yaml");
  const fs::path incoming = root / "incoming";
  if (!fs::is_directory(incoming, error))
    return Error{"submit.spool", incoming.string(), "is no folder",
                 "start weldcelld once, or name the right spool"};

  const std::string name = job_file.stem().string();
  const fs::path staging = incoming / (".submit-" + name + "-" + std::to_string(::getpid()) + ".tmp");
  fs::remove_all(staging, error);
  if (::mkdir(staging.c_str(), 0770) != 0)
    return Error{"submit.spool", staging.string(), std::strerror(errno),
                 "join the group that owns the spool"};
  struct stat spool {};
  ::stat(incoming.c_str(), &spool);
  share(staging, 0770, spool.st_gid);
  const fs::path target = incoming / name;
  std::optional<Error> fault = fill(staging, sources, spool.st_gid);
  if (!fault) {
    const int reason = rename_fresh(staging, target);
    if (reason == EEXIST || reason == ENOTEMPTY)
      fault = Error{"submit.duplicate", target.string(), "a job of this name waits already",
                    "wait until it is taken, or rename the job file"};
    else if (reason != 0)
      fault = Error{"submit.spool", target.string(), std::strerror(reason),
                    "check the spool's rights and its disk"};
  }
  if (fault) {
    fs::remove_all(staging, error);
    return *fault;
  }
  sync_folder(incoming);
  return target;
}

}  // namespace weldcell::adapters
