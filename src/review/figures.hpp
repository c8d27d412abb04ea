// The figures of the report: plan, scan, edges, fit, residuals. Each is empty when its data are. Pure.
#pragma once

#include <string>

#include "weldcell/review/report.hpp"

namespace weldcell::review {

std::string plan_figure(const ReportInput& input);
std::string scan_figure(const ReportInput& input);
std::string edge_figure(const ReportInput& input);
/// Planned outline dotted, found outline blue, edge points red: the picture of the paper's Fig. 11.
std::string fit_figure(const ReportInput& input);
/// Residuals as arrows from the found outline, drawn larger than they are.
std::string arrow_figure(const ReportInput& input);
std::string residual_histogram(const ReportInput& input);

}  // namespace weldcell::review
