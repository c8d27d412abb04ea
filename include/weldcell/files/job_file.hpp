// job.yaml -> JobOrder.
#pragma once

#include <string_view>
#include <variant>

#include "weldcell/files/fault.hpp"
#include "weldcell/job/job_order.hpp"

namespace weldcell::files {

std::variant<job::JobOrder, Faults> parse_job(std::string_view text, const std::string& name);
std::variant<job::JobOrder, Faults> read_job_file(const std::string& path);

}  // namespace weldcell::files
