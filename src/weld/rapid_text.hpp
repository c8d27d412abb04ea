// RAPID literals as RobotWare 6 reads them. Pure.
#pragma once

#include <string>
#include <string_view>

#include "weldcell/weld/rapid.hpp"

namespace weldcell::weld::rapid {

/// Fixed decimals without a negative zero.
std::string number(double value, int decimals);
/// "[x,y,z]", mm, 4 decimals.
std::string position(const Eigen::Vector3d& mm);
/// "[q1,q2,q3,q4]", w first, 8 decimals, the sign that is closer to `like` (w >= 0 when like is zero).
std::string quaternion(const Eigen::Matrix3d& rotation, Eigen::Quaterniond& like);
/// "[[j1..j6],[9E+09 x6]]", degrees.
std::string jointtarget(const kinematics::Joints& joints);
/// "[[pos],[quat],[conf],[9E+09 x6]]".
std::string robtarget(const TorchTarget& target, Eigen::Quaterniond& like);
/// The text fit for a comment: printable ASCII, at most `limit` characters.
std::string comment(std::string_view text, std::size_t limit = 120);

}  // namespace weldcell::weld::rapid
