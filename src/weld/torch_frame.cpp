#include <cmath>

#include "weldcell/weld/rapid.hpp"

namespace weldcell::weld {

Transform<Base, Torch> torch_frame(const Eigen::Vector3d& tip, const Eigen::Vector3d& travel,
                                   double work_angle_rad, double travel_angle_rad, double roll_rad) {
  const Eigen::Vector3d t = travel.normalized();
  const Eigen::Vector3d left = Eigen::Vector3d::UnitZ().cross(t).normalized();
  const Eigen::Vector3d up = t.cross(left);
  const Eigen::Vector3d body =
      std::cos(travel_angle_rad) * (std::cos(work_angle_rad) * up + std::sin(work_angle_rad) * left) -
      std::sin(travel_angle_rad) * t;
  const Eigen::Vector3d z = -body;
  const Eigen::Vector3d ahead = (t - t.dot(z) * z).normalized();
  const Eigen::Vector3d x = std::cos(roll_rad) * ahead + std::sin(roll_rad) * z.cross(ahead);
  Transform<Base, Torch> out;
  out.iso.linear().col(0) = x;
  out.iso.linear().col(1) = z.cross(x);
  out.iso.linear().col(2) = z;
  out.iso.translation() = tip;
  return out;
}

}  // namespace weldcell::weld
