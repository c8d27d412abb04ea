// Edge and path CSV files.
#pragma once

#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "weldcell/files/fault.hpp"
#include "weldcell/geometry/edge_point.hpp"

namespace weldcell::files {

std::variant<std::vector<EdgePoint>, Faults> parse_edges(std::string_view csv, const std::string& name);
std::variant<std::vector<PathPiece>, Faults> parse_path(std::string_view csv, const std::string& name);
std::string edges_csv(const std::vector<EdgePoint>& edges);
std::string path_csv(const std::vector<PathPiece>& path);

}  // namespace weldcell::files
