// Rigid transforms whose frames are types: Transform<Base, Flange> takes a Point<Flange> to a Point<Base>.
// Pure.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace weldcell {

// The frames of the cell. docs/TERMS.md defines each once.
struct Base {};    ///< robot base, the paper's C_R; z up
struct Flange {};  ///< ABB tool0; +Z out of the flange
struct Laser {
};  ///< origin at zero range; +Z along the beam; +X towards the receiver (triangulation plane = XZ)
struct Torch {};      ///< TCP at the wire tip; +Z out of the nozzle
struct Projector {};  ///< optical centre; +Z along the optical axis, +X right and +Y down in the picture
struct Table {};      ///< table top, z up
struct Part {};       ///< CAD frame of the workpiece; z = 0 on the table top

/// A point in frame F, millimetres.
template <typename F>
struct Point {
  Eigen::Vector3d mm = Eigen::Vector3d::Zero();
};

/// A pose of frame From in frame To: p_to = T * p_from; translation in mm.
template <typename To, typename From>
struct Transform {
  Eigen::Isometry3d iso = Eigen::Isometry3d::Identity();

  Point<To> operator*(const Point<From>& p) const { return {iso * p.mm}; }
  template <typename Further>
  Transform<To, Further> operator*(const Transform<From, Further>& other) const {
    return {iso * other.iso};
  }
  Transform<From, To> inverse() const { return {iso.inverse()}; }
  Eigen::Vector3d position_mm() const { return iso.translation(); }
  Eigen::Matrix3d rotation() const { return iso.linear(); }
};

}  // namespace weldcell
