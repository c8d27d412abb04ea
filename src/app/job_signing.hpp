// A job file as it may be run: read once, its signature checked over the very bytes that are then parsed.
#pragma once

#include <string>

#include "weldcell/files/cell_file.hpp"
#include "weldcell/job/job_order.hpp"

namespace weldcell::app {

/// Beside the job file, as minisign names it.
inline std::string signature_file_of(const std::string& job_file) { return job_file + ".minisig"; }

struct ReadJob {
  job::JobOrder order;
  std::string text;    ///< what was checked and parsed
  std::string signer;  ///< "signed by the key ..., trusted comment '...'"; "" without a signature that counts
  bool signature_there = false;
};

/// By jobs.unsigned and jobs.signed_by of the cell file. Errors: "job.unsigned" (refused without a signature,
/// which may still come), "job.signature" (there, and not good; or the job does not bind its workpiece by
/// `revision`), "job.file" (faults in the job file, one a line).
Result<ReadJob> read_job(const std::string& job_file, const files::CellConfig& config);

}  // namespace weldcell::app
