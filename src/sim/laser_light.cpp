#include "sim/laser_light.hpp"

#include <algorithm>
#include <cmath>

#include "sim/noise.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::sim {

namespace {

constexpr double kPatch_mm = 8;
constexpr double kPatchy = 0.5;
constexpr std::uint64_t kPatchPurpose = 0x70617463;
constexpr double kLeastGain = 0.5, kMostGain = 50;

struct Lobe {
  double diffuse, specular, width_rad;
};

Lobe lobe_of(Finish finish) {
  switch (finish) {
    case Finish::MillScale:
      return {0.15, 0.1, rad(12)};
    case Finish::GroundSteel:
      return {0.35, 0.5, rad(5)};
    case Finish::Galvanized:
      return {0.5, 0.6, rad(6)};
    case Finish::Aluminium:
      return {0.6, 0.8, rad(4)};
    case Finish::Ideal:
    case Finish::Ceramic:
      break;
  }
  return {1, 0, 1};
}

/// Between 1 - kPatchy and 1 + kPatchy, one value a zinc crystal.
double patch(const Eigen::Vector3d& place, std::uint64_t seed) {
  const auto cell = [](double mm) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(mm / kPatch_mm)));
  };
  const std::uint64_t key = cell(place.x()) * 0x1F123BB5ULL ^ cell(place.y());
  return 1 + kPatchy * (2 * uniform(mixed(seed, key, kPatchPurpose)) - 1);
}

}  // namespace

double brightness(Finish finish, const Eigen::Vector3d& beam, const Eigen::Vector3d& to_receiver,
                  const Eigen::Vector3d& place_mm, std::uint64_t seed) {
  if (finish == Finish::Ideal) return 1;
  const Lobe lobe = lobe_of(finish);
  const Eigen::Vector3d mirrored(beam.x(), beam.y(), -beam.z());
  const double off_rad = std::acos(std::clamp(mirrored.dot(to_receiver), -1.0, 1.0));
  const double ratio = off_rad / lobe.width_rad;
  const double seen = std::max(0.0, to_receiver.z()) + lobe.specular * std::exp(-ratio * ratio);
  return lobe.diffuse * seen * (finish == Finish::Galvanized ? patch(place_mm, seed) : 1);
}

ExposureLoop::Level ExposureLoop::next(double light) {
  // Nothing seen leaves the gain where it is.
  if (before_[at_] > 0) gain_ = std::clamp(1 / before_[at_], kLeastGain, kMostGain);
  before_[at_] = light;
  at_ = (at_ + 1) % kPipeline;
  const double level = light * gain_;
  Level out;
  out.lost = level < kDark || level > kBurnt;
  // Shot noise in the dark; a flat-topped peak has a poor centroid.
  out.noise_factor = level > kSaturated ? 5 : 1 / std::sqrt(std::clamp(level, kDark, 1.0));
  return out;
}

double linearity_error_mm(double reading_mm, double range_mm, double share) {
  const double u = 2 * kPi * reading_mm / range_mm;
  // The two terms peak together once in the range, at the stated share.
  return share * range_mm * (0.7 * std::sin(u) - 0.3 * std::sin(3 * u));
}

double tilt_error_mm(const Eigen::Vector3d& beam, const Eigen::Vector3d& towards_receiver, double range_mm) {
  constexpr std::array<std::array<double, 2>, 4> kTable{{{0, 0}, {5, 0.0012}, {15, 0.002}, {30, 0.005}}};
  // Only the tilt in the triangulation plane moves the spot's centre of light.
  const double lean_deg =
      deg(std::asin(std::clamp(beam.head<2>().dot(towards_receiver.head<2>().normalized()), -1.0, 1.0)));
  const double tilt = std::min(std::abs(lean_deg), kTable.back()[0]);
  std::size_t i = 1;
  while (tilt > kTable[i][0]) ++i;
  const auto& [from, to] = std::array{kTable[i - 1], kTable[i]};
  const double share = from[1] + (to[1] - from[1]) * (tilt - from[0]) / (to[0] - from[0]);
  return std::copysign(share * range_mm, lean_deg);
}

}  // namespace weldcell::sim
