// The tables of the report. Each is empty when its data are. Pure.
#pragma once

#include <string>

#include "weldcell/review/report.hpp"

namespace weldcell::review {

std::string weld_table(const ReportInput& input);
std::string member_table(const ReportInput& input);
std::string height_table(const ReportInput& input);
std::string pass_table(const ReportInput& input);
std::string event_table(const ReportInput& input);
std::string figure_table(const ReportInput& input);

}  // namespace weldcell::review
