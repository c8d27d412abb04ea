// An arm as somebody else published it: joint by joint, without a closed form. tests/data/kinematics/chains.
#pragma once

#include <Eigen/Geometry>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "weldcell/base/units.hpp"
#include "weldcell/kinematics/arm_model.hpp"

namespace weldcell::testing {

/// "urdf" has each joint's origin in the link before it and the axis it turns about; "modified_dh" (Craig)
/// and "dh" have the four parameters of each link.
struct Chain {
  std::string kind;
  double rounded_mm = 0;  ///< by which the published lengths are rounded
  struct Link {
    std::vector<double> values;  ///< mm or deg, in the file's order
    char axis = 0;               ///< of "urdf"; 0: fixed
  };
  std::vector<Link> links;
};

inline Chain read_chain(const std::filesystem::path& path) {
  Chain out;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    const std::string rounded = "# rounded_mm ";
    if (line.starts_with(rounded)) out.rounded_mm = std::stod(line.substr(rounded.size()));
    if (line.empty() || line[0] == '#') continue;
    std::stringstream fields(line);
    std::string field;
    std::getline(fields, field, ',');
    if (out.kind.empty()) {
      out.kind = field;
      continue;
    }
    Chain::Link link;
    while (std::getline(fields, field, ',')) {
      if (field == "x" || field == "y" || field == "z") {
        link.axis = field[0];
      } else if (!field.empty()) {
        link.values.push_back(std::stod(field));
      }
    }
    out.links.push_back(link);
  }
  return out;
}

/// Pose of the last link for serial joint angles, rad: for an arm with a parallel linkage not ABB's J3.
inline Eigen::Isometry3d forward(const Chain& chain, const kinematics::Joints& serial) {
  using Eigen::AngleAxisd;
  using Eigen::Translation3d;
  using Eigen::Vector3d;
  const bool urdf = chain.kind == "urdf";
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  for (std::size_t i = 0; i < chain.links.size(); ++i) {
    const std::vector<double>& v = chain.links[i].values;
    const double q = i < serial.size() ? serial[i] : 0;
    if (urdf) {
      const char axis = chain.links[i].axis;
      out = out * Translation3d(v.at(0), v.at(1), v.at(2));
      if (axis != 0) out = out * AngleAxisd(q, Vector3d(axis == 'x', axis == 'y', axis == 'z'));
      continue;
    }
    const AngleAxisd twist(rad(v.at(0)), Vector3d::UnitX()), turn(q + rad(v.at(3)), Vector3d::UnitZ());
    const Translation3d along(v.at(1), 0, 0), up(0, 0, v.at(2));
    out = chain.kind == "dh" ? out * turn * up * along * twist : out * twist * along * turn * up;
  }
  // URDF's last link has x out of the flange, ABB's tool0 has z there.
  return urdf ? out * AngleAxisd(kPi / 2, Vector3d::UnitY()) : out;
}

}  // namespace weldcell::testing
