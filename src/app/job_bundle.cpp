#include "app/job_bundle.hpp"

#include <Poco/DigestEngine.h>
#include <Poco/SHA2Engine.h>

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

Result<std::string> file_revision(const std::string& path) {
  const auto text = read_file(path);
  if (!text.ok()) return text.error();
  Poco::SHA2Engine sha;
  sha.update(text->data(), text->size());
  return "sha256:" + Poco::DigestEngine::digestToHex(sha.digest());
}

Result<workpiece::Workpiece> load_workpiece(const job::JobOrder& order, const std::string& folder,
                                            const std::string& cad_cache_dir) {
  const fs::path path = fs::path(folder) / order.workpiece_file;
  std::error_code error;
  if (!fs::is_regular_file(path, error)) {
    return Error{"workpiece.missing", path.string(), "the workpiece file is not there",
                 "put it beside the job file, or correct 'workpiece'"};
  }
  if (!order.revision.empty()) {
    const auto revision = file_revision(path.string());
    if (!revision.ok()) return revision.error();
    if (*revision != order.revision) {
      return Error{"workpiece.revision", path.string(),
                   "its revision is " + *revision + ", the job wants " + order.revision,
                   "send the right file, or correct 'revision'"};
    }
  }
  if (is_cad(path)) {
    std::string warning;
    auto workpiece = adapters::import_cad(cad_program(), path.string(), order.cad, cad_cache_dir, &warning);
    if (!warning.empty()) std::fprintf(stderr, "%s\n", warning.c_str());
    return workpiece;
  }
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
