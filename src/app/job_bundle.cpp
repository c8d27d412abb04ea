#include "app/job_bundle.hpp"

#include <Poco/DigestEngine.h>
#include <Poco/SHA2Engine.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "app/places.hpp"
#include "weldcell/adapters/cad_child.hpp"
#include "weldcell/files/job_file.hpp"
#include "weldcell/files/workpiece_file.hpp"

namespace weldcell::app {

namespace fs = std::filesystem;

namespace {

bool is_cad(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return extension == ".step" || extension == ".stp" || extension == ".dxf";
}

}  // namespace

std::string revision_of(const std::string& text) {
  Poco::SHA2Engine sha;
  sha.update(text.data(), text.size());
  return "sha256:" + Poco::DigestEngine::digestToHex(sha.digest());
}

namespace {

/// The bytes whose revision was checked, where nobody else can write: the file itself may change meanwhile.
class CheckedCopy {
 public:
  CheckedCopy(const fs::path& dir, const fs::path& name, const std::string& text)
      : folder_(dir / ("checked-" + std::to_string(::getpid()))), path_(folder_ / name) {
    std::error_code error;
    fs::remove_all(folder_, error);
    fs::create_directories(dir, error);
    if (::mkdir(folder_.c_str(), 0700) == 0) status_ = write_file_durably(path_.string(), text);
  }
  ~CheckedCopy() {
    std::error_code error;
    fs::remove_all(folder_, error);
  }
  CheckedCopy(const CheckedCopy&) = delete;
  CheckedCopy& operator=(const CheckedCopy&) = delete;
  const Status& status() const { return status_; }
  std::string path() const { return path_.string(); }

 private:
  fs::path folder_, path_;
  Status status_ =
      Error{"file.write", "", "the state folder cannot be written", "check space and permissions"};
};

Result<workpiece::Workpiece> imported(const job::JobOrder& order, const std::string& path,
                                      const std::string& cad_cache_dir) {
  std::string warning;
  auto workpiece = adapters::import_cad(cad_program(), path, order.cad, cad_cache_dir, &warning);
  if (!warning.empty()) std::fprintf(stderr, "%s\n", warning.c_str());
  return workpiece;
}

Result<workpiece::Workpiece> load_checked(const job::JobOrder& order, const fs::path& path,
                                          const std::string& cad_cache_dir) {
  const auto text = read_file(path.string());
  if (!text.ok()) return text.error();
  if (const std::string revision = revision_of(*text); revision != order.revision) {
    return Error{"workpiece.revision", path.string(),
                 "its revision is " + revision + ", the job wants " + order.revision,
                 "send the right file, or correct 'revision'"};
  }
  if (!is_cad(path)) {
    auto read = files::parse_workpiece(*text, path.string());
    if (const auto* faults = std::get_if<files::Faults>(&read))
      return Error{"workpiece.file", "", files::text(*faults), ""};
    return std::get<workpiece::Workpiece>(std::move(read));
  }
  if (cad_cache_dir.empty()) return imported(order, path.string(), cad_cache_dir);
  const CheckedCopy copy(cad_cache_dir, path.filename(), *text);
  if (!copy.status().ok()) return copy.status().error();
  auto workpiece = imported(order, copy.path(), cad_cache_dir);
  if (workpiece.ok() || workpiece.error().where != copy.path()) return workpiece;
  Error error = workpiece.error();
  error.where = path.string();
  return error;
}

}  // namespace

Result<workpiece::Workpiece> load_workpiece(const job::JobOrder& order, const std::string& folder,
                                            const std::string& cad_cache_dir) {
  const fs::path path = fs::path(folder) / order.workpiece_file;
  std::error_code error;
  if (!fs::is_regular_file(path, error)) {
    return Error{"workpiece.missing", path.string(), "the workpiece file is not there",
                 "put it beside the job file, or correct 'workpiece'"};
  }
  if (!order.revision.empty()) return load_checked(order, path, cad_cache_dir);
  if (is_cad(path)) return imported(order, path.string(), cad_cache_dir);
  auto read = files::read_workpiece_file(path.string());
  if (const auto* faults = std::get_if<files::Faults>(&read)) {
    return Error{"workpiece.file", "", files::text(*faults), ""};
  }
  return std::get<workpiece::Workpiece>(std::move(read));
}

std::variant<JobBundle, std::string> load_job(const std::string& job_file, const std::string& cad_cache_dir) {
  auto parsed = files::read_job_file(job_file);
  if (const auto* faults = std::get_if<files::Faults>(&parsed)) return files::text(*faults);
  JobBundle bundle;
  bundle.order = std::get<job::JobOrder>(std::move(parsed));
  auto text = read_file(job_file);
  if (!text.ok()) return text.error().text();
  bundle.job_text = *text;
  auto workpiece = load_workpiece(bundle.order, fs::absolute(job_file).parent_path().string(), cad_cache_dir);
  if (!workpiece.ok()) return workpiece.error().text();
  bundle.workpiece = *workpiece;
  bundle.workpiece_yaml = files::workpiece_yaml(bundle.workpiece);
  return bundle;
}

}  // namespace weldcell::app
