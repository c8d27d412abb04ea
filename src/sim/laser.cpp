#include "weldcell/sim/laser.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/noise.hpp"
#include "sim/surface.hpp"
#include "weldcell/wire/laser.hpp"

namespace weldcell::sim {

namespace {

// Error words of the optoNCDT 2300.
constexpr std::uint32_t kNoPeak = 0x7FFFFFFB;
constexpr std::uint32_t kBeforeRange = 0x7FFFFFFA;
constexpr std::uint32_t kAfterRange = 0x7FFFFFF9;

constexpr double kBlock_s = 0.004;
constexpr double kLeastLight = 0.06;    // of a full spot: below it the sensor finds no peak
constexpr double kPeaksApart_mm = 3.0;  // images farther apart than this are two peaks, not one
constexpr double kWire_ms = 0.05;       // floor of the transport
constexpr std::uint32_t kOrderNumber = 4120176, kSerialNumber = 260021;

enum Purpose : std::uint64_t { White = 1, Outlier, OutlierSize, Dropout, Transport, Speckle };

/// Where in the spot, in units of its 1/e2 radius, and how much light.
struct SpotPoint {
  double x, y, weight;
  std::size_t shot;  ///< 0, 1, 2: which third of the exposure it stands for
};

std::vector<SpotPoint> spot_points(bool whole_spot) {
  if (!whole_spot) return {{0, 0, 1, 1}};
  std::vector<SpotPoint> out;
  double sum = 0;
  for (int i = -4; i <= 4; ++i) {
    for (int j = -2; j <= 2; ++j) {
      const double x = i * 0.36, y = j * 0.65;
      const double weight = std::exp(-2 * (x * x + y * y));
      if (weight < 0.002) continue;
      out.push_back({x, y, weight, static_cast<std::size_t>(i + 2 * j + 12) % 3});
      sum += weight;
    }
  }
  for (SpotPoint& point : out) point.weight /= sum;
  return out;
}

struct Seen {
  double distance_mm, weight;
};

}  // namespace

struct LaserDevice::State {
  explicit State(const Scene& s)
      : scene(s),
        setup(s.cell.setup.laser),
        truth(s.laser),
        layout(s.cell.laser_layout),
        spot(spot_points(s.laser.beam_spot)),
        baseline_mm((setup.start_of_range_mm + setup.range_mm / 2) * std::tan(truth.triangulation_rad)),
        surface(s, 0.8 * s.laser.spot_mm + 0.2) {
    per_block = std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(kBlock_s * setup.rate_hz)));
    const std::size_t fit = (1400 - 28) / layout.frame_bytes();
    per_block = std::min(per_block, std::max<std::size_t>(1, fit));
    block.reserve(per_block);
  }

  HostTime instant(std::uint64_t k) const {
    const double device_s = static_cast<double>(k) / setup.rate_hz;
    return {static_cast<Nanoseconds>(std::llround(device_s / (1 + truth.clock.drift_ppm * 1e-6) * 1e9))};
  }
  std::uint32_t stamp_us(HostTime t) const {
    const double device_s = truth.clock.offset_s + seconds(t.ns) * (1 + truth.clock.drift_ppm * 1e-6);
    return static_cast<std::uint32_t>(static_cast<std::uint64_t>(std::floor(device_s * 1e6)));
  }

  double speckle(double x_mm, double y_mm) const;
  bool only_table(const Eigen::Vector3d& at_table, const Eigen::Vector3d& at_top, const Eigen::Vector3d& eye);
  double look(const std::array<Eigen::Isometry3d, 3>& shots, double& light) const;
  double centroid(std::array<Seen, 64>& seen, std::size_t count, double& light) const;
  wire::LaserReading measure(std::uint64_t k, HostTime t, const PoseAt& pose_at);
  Eigen::Isometry3d beam(HostTime t, const PoseAt& pose_at) const {
    return pose_at(t).iso * setup.T_flange_laser.iso;
  }
  void finish_block(HostTime last, std::vector<LaserBlock>& out);

  const Scene scene;
  const cell::LaserSetup setup;
  const LaserTruth truth;
  const wire::Meas28Layout layout;
  const std::vector<SpotPoint> spot;
  const double baseline_mm;
  Surface surface;
  std::size_t per_block = 20;
  std::uint64_t next = 0;
  std::vector<wire::LaserReading> block;
  HostTime last_arrival, drop_until, stall_until;
  HostTime now;
};

double LaserDevice::State::speckle(double x_mm, double y_mm) const {
  const double grid = std::max(0.05, truth.spot_mm / 2);
  const double u = x_mm / grid, v = y_mm / grid;
  const double fu = std::floor(u), fv = std::floor(v), a = u - fu, b = v - fv;
  const auto at = [&](double i, double j) {
    const auto key = static_cast<std::uint64_t>(static_cast<std::int64_t>(i)) * 0x1F123BB5ULL ^
                     static_cast<std::uint64_t>(static_cast<std::int64_t>(j));
    return normal(mixed(scene.seed, key, Speckle));
  };
  const double wa[2] = {1 - a, a}, wb[2] = {1 - b, b};
  double sum = 0, power = 0;
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 2; ++j) {
      const double w = wa[i] * wb[j];
      sum += w * at(fu + i, fv + j);
      power += w * w;
    }
  }
  return sum / std::sqrt(power);
}

/// Distance that the detector decodes along the beam, from every lit and visible point of the spot; light =
/// share of a full spot in the peak that was taken.
double LaserDevice::State::look(const std::array<Eigen::Isometry3d, 3>& shots, double& light) const {
  const double radius = truth.spot_mm / 2;
  std::array<Seen, 64> seen{};
  std::size_t count = 0;
  light = 0;
  for (const SpotPoint& point : spot) {
    // The spot's points are dealt out to the begin, middle and end of the exposure: the motion's blur at one
    // spot's cost.
    const Eigen::Isometry3d& laser = shots[point.shot];
    const Eigen::Vector3d from = laser.translation(), x = laser.linear().col(0), y = laser.linear().col(1),
                          down = laser.linear().col(2), eye = from + baseline_mm * x;
    const double dx = point.x * radius, dy = point.y * radius;
    const Eigen::Vector3d ray = from + dx * x + dy * y;
    const double z = surface.cast(ray, down);
    if (z <= 0) continue;
    const Eigen::Vector3d hit = ray + z * down;
    if (truth.shadows && !surface.sees(hit, eye)) continue;
    // The receiver takes a point beside the beam for one nearer or farther on it.
    seen[count++] = {z * baseline_mm / (baseline_mm - dx), point.weight};
  }
  return centroid(seen, count, light);
}

double LaserDevice::State::centroid(std::array<Seen, 64>& seen, std::size_t count, double& light) const {
  std::sort(seen.begin(), seen.begin() + static_cast<std::ptrdiff_t>(count),
            [](const Seen& a, const Seen& b) { return a.distance_mm < b.distance_mm; });
  double best = 0, best_image = 0;
  for (std::size_t begin = 0; begin < count;) {
    double weight = 0, image = 0;
    std::size_t i = begin;
    do {
      weight += seen[i].weight;
      image += seen[i].weight / seen[i].distance_mm;  // a place on the detector is linear in 1/distance
      ++i;
    } while (i < count && seen[i].distance_mm - seen[i - 1].distance_mm < kPeaksApart_mm);
    if (weight > best) {
      best = weight;
      best_image = image / weight;
    }
    begin = i;
  }
  light = best;
  return best > 0 ? 1 / best_image : -1;
}

/// Whether the beam and the receiver's view both keep clear of every member, so that only the table is seen.
bool LaserDevice::State::only_table(const Eigen::Vector3d& at_table, const Eigen::Vector3d& at_top,
                                    const Eigen::Vector3d& eye) {
  const auto clear = [this, &at_table](const Eigen::Vector3d& way) {
    const int steps = static_cast<int>(std::ceil(way.head<2>().norm() / std::max(0.5, truth.spot_mm)));
    for (int i = 0; i <= steps; ++i) {
      const Eigen::Vector3d at = at_table + way * (steps > 0 ? static_cast<double>(i) / steps : 0.0);
      if (surface.around(at.x(), at.y()) != Surface::Around::Table) return false;
    }
    return true;
  };
  const double rise = surface.top_mm() - surface.table_mm();
  const Eigen::Vector3d view = (eye - at_table) * (rise / std::max(1.0, eye.z() - at_table.z()));
  return clear(at_top - at_table) && (!truth.shadows || clear(view));
}

wire::LaserReading LaserDevice::State::measure(std::uint64_t k, HostTime t, const PoseAt& pose_at) {
  const Eigen::Isometry3d laser = beam(t, pose_at);
  wire::LaserReading out;
  const auto roll = [&](Purpose purpose) { return mixed(scene.seed, k, purpose); };
  const auto invalid = [&](std::uint32_t code) {
    out.code = code;
    return out;
  };
  const Eigen::Vector3d from = laser.translation(), down = laser.linear().col(2);
  if (down.z() > -0.05 || uniform(roll(Dropout)) < truth.dropout_share) return invalid(kNoPeak);
  const double to_table = (from.z() - surface.table_mm()) / -down.z();
  const double to_top = (from.z() - surface.top_mm()) / -down.z();
  const double end = setup.start_of_range_mm + setup.range_mm;
  if (to_top > end + 5) return invalid(kAfterRange);
  if (to_table < setup.start_of_range_mm) return invalid(kBeforeRange);
  double light = 1, distance = 0;
  const Eigen::Vector3d at_top = from + to_top * down, at_table = from + to_table * down;
  if (surface.around(at_top.x(), at_top.y()) == Surface::Around::Top) {
    distance = to_top;
  } else if (only_table(at_table, at_top, from + baseline_mm * laser.linear().col(0))) {
    distance = to_table;
  } else {
    const Nanoseconds third = from_seconds(truth.exposure_ms * 1e-3 / 3);
    distance = look({beam(t - third, pose_at), laser, beam(t + third, pose_at)}, light);
  }
  if (light < kLeastLight || distance <= 0) return invalid(kNoPeak);
  if (distance < setup.start_of_range_mm) return invalid(kBeforeRange);
  if (distance > end) return invalid(kAfterRange);
  double reading = distance - setup.start_of_range_mm;
  const Eigen::Vector3d hit = from + distance * down;
  if (truth.noise_mm > 0) reading += truth.noise_mm * normal(roll(White)) / std::sqrt(light);
  if (truth.speckle_mm > 0) reading += truth.speckle_mm * speckle(hit.x(), hit.y());
  if (uniform(roll(Outlier)) < truth.outlier_share) {
    const double size = uniform(roll(OutlierSize));
    if (size > 0.8) return invalid(kNoPeak);
    reading += (size / 0.4 - 1) * 0.1 * setup.range_mm;
  }
  if (reading < 0) return invalid(kBeforeRange);
  if (reading > setup.range_mm) return invalid(kAfterRange);
  out.distance_mm = static_cast<float>(std::round(reading * 1e6) * 1e-6);
  return out;
}

void LaserDevice::State::finish_block(HostTime last, std::vector<LaserBlock>& out) {
  const double ready_ms = truth.latency_ms + kWire_ms;
  const double jitter_ms =
      -truth.transport_jitter_ms * std::log(1 - uniform(mixed(scene.seed, next, Transport)));
  HostTime arrival = last + from_seconds((ready_ms + jitter_ms) * 1e-3);
  arrival = std::max({arrival, last_arrival, stall_until});
  last_arrival = arrival;
  LaserBlock done;
  done.arrival = arrival;
  done.bytes.resize(28 + block.size() * layout.frame_bytes());
  const std::size_t size = wire::encode_meas28(layout, block, kOrderNumber, kSerialNumber, done.bytes);
  done.bytes.resize(size);
  if (last >= drop_until && size > 0) out.push_back(std::move(done));
  block.clear();
}

LaserDevice::LaserDevice(const Scene& scene) : state_(std::make_unique<State>(scene)) {}
LaserDevice::~LaserDevice() = default;

std::vector<LaserBlock> LaserDevice::advance(HostTime now, const PoseAt& pose_at) {
  State& s = *state_;
  std::vector<LaserBlock> out;
  s.now = now;
  for (HostTime t = s.instant(s.next); t <= now; t = s.instant(s.next)) {
    wire::LaserReading reading = s.measure(s.next, t, pose_at);
    reading.counter = static_cast<std::uint32_t>(s.next);
    reading.timestamp_us = s.stamp_us(t + from_seconds(s.truth.latency_ms * 1e-3));
    s.block.push_back(reading);
    ++s.next;
    if (s.block.size() >= s.per_block) s.finish_block(t, out);
  }
  return out;
}

bool LaserDevice::inject(const std::string& fault, double duration_s) {
  const HostTime until = duration_s > 0 ? state_->now + from_seconds(duration_s) : HostTime{INT64_MAX / 2};
  if (fault == "laser_drop") {
    state_->drop_until = until;
  } else if (fault == "laser_stall") {
    state_->stall_until = until;
  } else {
    return false;
  }
  return true;
}

bool LaserDevice::connected() const { return state_->now >= state_->drop_until; }

}  // namespace weldcell::sim
