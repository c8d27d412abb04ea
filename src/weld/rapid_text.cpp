#include "rapid_text.hpp"

#include <fmt/format.h>

#include <cmath>

#include "weldcell/base/units.hpp"

namespace weldcell::weld::rapid {

namespace {
constexpr const char* kNoExternals = "[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]";
}

std::string number(double value, int decimals) {
  std::string out = fmt::format("{:.{}f}", value, decimals);
  if (out.find('.') != std::string::npos) {
    out.erase(out.find_last_not_of('0') + 1);
    if (out.back() == '.') out.pop_back();
  }
  return out == "-0" ? "0" : out;
}

std::string position(const Eigen::Vector3d& mm) {
  return "[" + number(mm.x(), 4) + "," + number(mm.y(), 4) + "," + number(mm.z(), 4) + "]";
}

std::string quaternion(const Eigen::Matrix3d& rotation, Eigen::Quaterniond& like) {
  Eigen::Quaterniond q(rotation);
  q.normalize();
  const double side = like.coeffs().squaredNorm() > 0 ? q.dot(like) : q.w();
  if (side < 0) q.coeffs() *= -1;
  like = q;
  return "[" + number(q.w(), 8) + "," + number(q.x(), 8) + "," + number(q.y(), 8) + "," + number(q.z(), 8) +
         "]";
}

std::string jointtarget(const kinematics::Joints& joints) {
  std::string out = "[[";
  for (std::size_t i = 0; i < 6; ++i) out += (i ? "," : "") + number(deg(joints[i]), 5);
  return out + "]," + kNoExternals + "]";
}

std::string robtarget(const TorchTarget& target, Eigen::Quaterniond& like) {
  const kinematics::Configuration& c = target.configuration;
  return "[" + position(target.T_base_torch.position_mm()) + "," +
         quaternion(target.T_base_torch.rotation(), like) +
         fmt::format(",[{},{},{},{}],", c.cf1, c.cf4, c.cf6, c.cfx) + kNoExternals + "]";
}

std::string comment(std::string_view text, std::size_t limit) {
  std::string out;
  for (const char c : text) {
    if (out.size() >= limit) break;
    const auto u = static_cast<unsigned char>(c);
    if ((u & 0xC0) == 0x80) continue;  // the rest of a UTF-8 character whose first byte became '?'
    out += u < 0x20 ? ' ' : u < 0x7F ? c : '?';
  }
  return out;
}

}  // namespace weldcell::weld::rapid
