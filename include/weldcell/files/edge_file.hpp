// Edge, path and gauge CSV files.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "weldcell/calibrate/latency.hpp"
#include "weldcell/files/fault.hpp"
#include "weldcell/geometry/edge_point.hpp"

namespace weldcell::files {

/// Edge points with the heights of the plateaus beside them where the file has them: Base, mm, one an edge,
/// NaN = unknown; empty without their column.
struct EdgeSet {
  std::vector<EdgePoint> edges;
  std::vector<double> top_z_mm, table_z_mm;
};

std::variant<EdgeSet, Faults> parse_edges(std::string_view csv, const std::string& name);
std::variant<std::vector<PathPiece>, Faults> parse_path(std::string_view csv, const std::string& name);
/// Crossings of a straight edge: direction (+1, -1), speed_mm_s and x_mm, the place seen along the travel of
/// a pass in direction +1; optional pass (not used), sigma_mm, edge (number of the straight edge), along_mm.
std::variant<std::vector<calibrate::GaugeCrossing>, Faults> parse_gauge(std::string_view csv,
                                                                        const std::string& name);
/// The heights may be empty, or as many as the edges.
std::string edges_csv(std::span<const EdgePoint> edges, std::span<const double> top_z_mm = {},
                      std::span<const double> table_z_mm = {});
std::string path_csv(const std::vector<PathPiece>& path);

}  // namespace weldcell::files
