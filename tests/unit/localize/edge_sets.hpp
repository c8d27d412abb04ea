// Reads the edge sets under tests/data/edges: workpiece, edges, path and truth. For tests only.
#pragma once

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "weldcell/base/units.hpp"
#include "weldcell/localize/localize.hpp"
#include "weldcell/workpiece/workpiece.hpp"

namespace weldcell::localize::testing {

inline std::string slurp(const std::string& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// The members of an edge set's workpiece.yaml, which are one line each.
inline workpiece::Workpiece read_workpiece(const std::string& folder, const std::string& name) {
  workpiece::Workpiece w;
  w.name = name;
  w.height_mm = 40;
  const std::string text = slurp(folder + "/" + name + "/workpiece.yaml");
  const std::regex member("name: (\\w+)\\s+tag: \"(\\w+)\"\\s+outline: (\\[\\[.*\\]\\])");
  for (std::sregex_iterator it(text.begin(), text.end(), member), end; it != end; ++it) {
    workpiece::Member m{(*it)[1], (*it)[2], {}, 0};
    for (const auto& p : nlohmann::json::parse((*it)[3].str()))
      m.outline.emplace_back(p[0].get<double>(), p[1].get<double>());
    w.members.push_back(m);
  }
  return *workpiece::validated(w);
}

struct EdgeSet {
  std::vector<EdgePoint> edges;
  std::vector<PathPiece> path;
  Pose2 truth;
};

inline std::vector<std::vector<double>> read_numbers(const std::string& path) {
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  std::vector<std::vector<double>> rows;
  while (std::getline(in, line)) {
    std::vector<double> row;
    std::stringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(std::stod(cell));
    rows.push_back(row);
  }
  return rows;
}

inline EdgeSet read_set(const std::string& folder, const std::string& name, const std::string& kind,
                        int index) {
  char number[8];
  std::snprintf(number, sizeof number, "%03d", index);
  const std::string stem = folder + "/" + name + "/" + kind + "/";
  EdgeSet out;
  for (const auto& r : read_numbers(stem + number + ".edges.csv")) {
    out.edges.push_back({r[0], r[1], r[2], r[3], static_cast<int>(r[4]), r[5], r[6], false});
  }
  for (const auto& r : read_numbers(stem + number + ".path.csv"))
    out.path.push_back({r[0], r[1], r[2], r[3]});
  const auto truth =
      nlohmann::json::parse(slurp(stem + "truth.json"))["truth"][static_cast<std::size_t>(index)];
  out.truth = {truth["x_mm"], truth["y_mm"], rad(truth["theta_deg"])};
  return out;
}

}  // namespace weldcell::localize::testing
