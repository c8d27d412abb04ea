// Edge, path and gauge CSV files.
#pragma once

#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "weldcell/calibrate/latency.hpp"
#include "weldcell/files/fault.hpp"
#include "weldcell/geometry/edge_point.hpp"

namespace weldcell::files {

std::variant<std::vector<EdgePoint>, Faults> parse_edges(std::string_view csv, const std::string& name);
std::variant<std::vector<PathPiece>, Faults> parse_path(std::string_view csv, const std::string& name);
/// Crossings of a straight edge: direction (+1, -1), speed_mm_s and x_mm, the place seen along the travel of
/// a pass in direction +1; optional pass (not used), sigma_mm, edge (number of the straight edge), along_mm.
std::variant<std::vector<calibrate::GaugeCrossing>, Faults> parse_gauge(std::string_view csv,
                                                                        const std::string& name);
std::string edges_csv(const std::vector<EdgePoint>& edges);
std::string path_csv(const std::vector<PathPiece>& path);

}  // namespace weldcell::files
