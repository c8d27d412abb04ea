// A job file with the workpiece that it names, read and checked; CAD goes through the weldcell-cad child.
#pragma once

#include <string>
#include <variant>

#include "weldcell/job/job_order.hpp"
#include "weldcell/workpiece/workpiece.hpp"

namespace weldcell::app {

struct JobBundle {
  job::JobOrder order;
  workpiece::Workpiece workpiece;
  std::string job_text, workpiece_yaml;
};

/// The workpiece that `order` names, beside the job file in `folder`; revision checked. The error names file,
/// cause, mend.
Result<workpiece::Workpiece> load_workpiece(const job::JobOrder& order, const std::string& folder,
                                            const std::string& cad_cache_dir);

/// Both; the text of every fault when something is wrong.
std::variant<JobBundle, std::string> load_job(const std::string& job_file, const std::string& cad_cache_dir);

/// "sha256:" and the 64 digits of the bytes.
std::string revision_of(const std::string& text);

}  // namespace weldcell::app
