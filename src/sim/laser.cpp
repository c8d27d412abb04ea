#include "weldcell/sim/laser.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "sim/laser_light.hpp"
#include "sim/laser_wire.hpp"
#include "sim/noise.hpp"
#include "sim/surface.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::sim {

namespace {

constexpr double kLeastLight = 0.06;    // of a full spot: below it the sensor finds no peak
constexpr double kPeaksApart_mm = 3.0;  // images farther apart than this are two peaks, not one
constexpr double kWayRound_mm = 8;      // most that light by way of a member's side travels farther
constexpr double kWire_ms = 0.05;       // floor of the transport

enum Purpose : std::uint64_t {
  White = 1,
  Outlier,
  OutlierSize,
  Dropout,
  Transport,
  Speckle,
  Secondary,
  SecondarySize
};

/// Where in the spot, in units of its 1/e2 radius.
struct SpotPoint {
  double x, y;
  std::size_t shot;  ///< 0, 1, 2: which third of the exposure it stands for
};

constexpr std::size_t kSpotPoints = 60;

/// Equal parts of the light of a Gaussian beam on a sunflower's spiral, each with its opposite: fine steps in
/// every direction, where a grid has coarse ones along its rows, and the centre of light in the middle.
std::vector<SpotPoint> spot_points(bool whole_spot) {
  if (!whole_spot) return {{0, 0, 1}};
  const double golden_rad = kPi * (3 - std::sqrt(5.0));
  std::vector<SpotPoint> out;
  for (std::size_t i = 0; i < kSpotPoints / 2; ++i) {
    const double outside =
        1 - (static_cast<double>(i) + 0.5) / (kSpotPoints / 2);  // share of the light farther out
    const double radius = std::sqrt(-std::log(outside) / 2), angle = golden_rad * static_cast<double>(i);
    const double x = radius * std::cos(angle), y = radius * std::sin(angle);
    out.push_back({x, y, i % 3});
    out.push_back({-x, -y, 2 - i % 3});
  }
  return out;
}

/// Light of one point of the spot, and its share of the spot.
struct Seen {
  double distance_mm, light, share;
};

/// What the detector takes for its peak.
struct Peak {
  double distance_mm = -1;
  double light = 0;  ///< brightness times share
  double share = 0;  ///< of a full spot
};

}  // namespace

struct LaserDevice::State {
  explicit State(const Scene& s)
      : scene(s),
        setup(s.cell.setup.laser),
        truth(s.laser),
        wire(s.cell.laser_format),
        spot(spot_points(s.laser.beam_spot)),
        baseline_mm((setup.start_of_range_mm + setup.range_mm / 2) * std::tan(truth.triangulation_rad)),
        to_level(from_level(s).inverse()),
        surface(s, 0.8 * s.laser.spot_mm + 0.2) {
    per_block = static_cast<std::size_t>(std::lround(wire.gather_s() * setup.rate_hz));
    per_block = std::clamp<std::size_t>(per_block, 1, wire.most_samples());
    block.reserve(per_block);
  }

  HostTime instant(std::uint64_t k) const {
    const double device_s = static_cast<double>(k) / setup.rate_hz;
    return {static_cast<Nanoseconds>(std::llround(device_s / (1 + truth.clock.drift_ppm * 1e-6) * 1e9))};
  }
  std::int64_t free_clock_ns(HostTime t) const {
    const double device_s = truth.clock.offset_s + seconds(t.ns) * (1 + truth.clock.drift_ppm * 1e-6);
    return static_cast<std::int64_t>(std::floor(device_s * 1e9));
  }
  /// As the sensor's clock shows it, whatever was done to it.
  std::uint64_t clock_ns(HostTime t) {
    const std::int64_t free = free_clock_ns(t) + clock_shift_ns;
    if (t < clock_stands_until) {
      if (clock_stands_ns < 0) clock_stands_ns = free;
      return static_cast<std::uint64_t>(clock_stands_ns);
    }
    if (clock_stands_ns < 0) return static_cast<std::uint64_t>(free);
    clock_shift_ns -= free - clock_stands_ns;
    const std::int64_t from = std::exchange(clock_stands_ns, -1);
    return static_cast<std::uint64_t>(from + 1000);
  }
  bool meddle_with_clock(const std::string& fault, double by_s);

  double speckle(double x_mm, double y_mm) const;
  bool only_table(const Eigen::Vector3d& at_table, const Eigen::Vector3d& at_top, const Eigen::Vector3d& eye);
  /// Light from a place on the top of a member, or on the table.
  double shine(bool on_part, const Eigen::Isometry3d& laser, const Eigen::Vector3d& hit) const;
  Peak look(const std::array<Eigen::Isometry3d, 3>& shots) const;
  Peak strongest(std::array<Seen, kSpotPoints>& seen, std::size_t count) const;
  Peak peak(const Eigen::Isometry3d& laser, HostTime t, std::uint64_t k, const PoseAt& pose_at);
  Sample measure(std::uint64_t k, HostTime t, const PoseAt& pose_at);
  /// The laser against the table as if that were level: rays and distances do not change by the turn.
  Eigen::Isometry3d beam(HostTime t, const PoseAt& pose_at) const {
    return to_level * pose_at(t).iso * setup.T_flange_laser.iso;
  }
  void finish_block(HostTime last, std::vector<LaserBlock>& out);

  const Scene scene;
  const cell::LaserSetup setup;
  const LaserTruth truth;
  const LaserWire wire;
  const std::vector<SpotPoint> spot;
  const double baseline_mm;
  const Eigen::Isometry3d to_level;
  Surface surface;
  ExposureLoop exposure;
  std::size_t per_block = 20;
  std::uint64_t next = 0;
  std::vector<Sample> block;
  HostTime last_arrival, drop_until, stall_until, clock_stands_until;
  std::int64_t clock_shift_ns = 0, clock_stands_ns = -1;
  std::uint64_t number_zero = 0;  ///< exposures before the running number began
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

double LaserDevice::State::shine(bool on_part, const Eigen::Isometry3d& laser,
                                 const Eigen::Vector3d& hit) const {
  const Finish finish = on_part ? truth.part : truth.table;
  if (finish == Finish::Ideal) return 1;
  const Eigen::Vector3d eye = laser.translation() + baseline_mm * laser.linear().col(0);
  return brightness(finish, laser.linear().col(2), (eye - hit).normalized(), hit, scene.seed);
}

/// What the detector makes of every lit and visible point of the spot.
Peak LaserDevice::State::look(const std::array<Eigen::Isometry3d, 3>& shots) const {
  const double radius = truth.spot_mm / 2;
  const double part = 1 / static_cast<double>(spot.size());
  std::array<Seen, kSpotPoints> seen{};
  std::size_t count = 0;
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
    const bool on_part = hit.z() > surface.table_mm() + 1e-3;
    // The receiver takes a point beside the beam for one nearer or farther on it.
    seen[count++] = {z * baseline_mm / (baseline_mm - dx), part * shine(on_part, laser, hit), part};
  }
  return strongest(seen, count);
}

Peak LaserDevice::State::strongest(std::array<Seen, kSpotPoints>& seen, std::size_t count) const {
  std::sort(seen.begin(), seen.begin() + static_cast<std::ptrdiff_t>(count),
            [](const Seen& a, const Seen& b) { return a.distance_mm < b.distance_mm; });
  Peak best;
  for (std::size_t begin = 0; begin < count;) {
    double light = 0, share = 0, image = 0;
    std::size_t i = begin;
    do {
      light += seen[i].light;
      share += seen[i].share;
      image += seen[i].light / seen[i].distance_mm;  // a place on the detector is linear in 1/distance
      ++i;
    } while (i < count && seen[i].distance_mm - seen[i - 1].distance_mm < kPeaksApart_mm);
    if (light > best.light) best = {light / image, light, share};
    begin = i;
  }
  return best;
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

Peak LaserDevice::State::peak(const Eigen::Isometry3d& laser, HostTime t, std::uint64_t k,
                              const PoseAt& pose_at) {
  const Eigen::Vector3d from = laser.translation(), down = laser.linear().col(2);
  const double to_table = (from.z() - surface.table_mm()) / -down.z();
  const double to_top = (from.z() - surface.top_mm()) / -down.z();
  const Eigen::Vector3d at_top = from + to_top * down, at_table = from + to_table * down;
  if (surface.around(at_top.x(), at_top.y()) == Surface::Around::Top)
    return {to_top, shine(true, laser, at_top), 1};
  if (only_table(at_table, at_top, from + baseline_mm * laser.linear().col(0)))
    return {to_table, shine(false, laser, at_table), 1};
  const Nanoseconds third = from_seconds(truth.exposure_ms * 1e-3 / 3);
  Peak out = look({beam(t - third, pose_at), laser, beam(t + third, pose_at)});
  if (out.distance_mm > 0.5 * (to_top + to_table) &&
      uniform(mixed(scene.seed, k, Secondary)) < truth.secondary_share) {
    out.distance_mm += 1 + (kWayRound_mm - 1) * uniform(mixed(scene.seed, k, SecondarySize));
  }
  return out;
}

Sample LaserDevice::State::measure(std::uint64_t k, HostTime t, const PoseAt& pose_at) {
  const Eigen::Isometry3d laser = beam(t, pose_at);
  Sample out;
  const auto roll = [&](Purpose purpose) { return mixed(scene.seed, k, purpose); };
  const auto invalid = [&](Echo echo) {
    out.echo = echo;
    return out;
  };
  const Eigen::Vector3d from = laser.translation(), down = laser.linear().col(2);
  if (down.z() > -0.05 || uniform(roll(Dropout)) < truth.dropout_share) return invalid(Echo::NoPeak);
  const double end = setup.start_of_range_mm + setup.range_mm;
  if ((from.z() - surface.top_mm()) / -down.z() > end + 5) return invalid(Echo::BehindRange);
  if ((from.z() - surface.table_mm()) / -down.z() < setup.start_of_range_mm)
    return invalid(Echo::BeforeRange);
  const Peak taken = peak(laser, t, k, pose_at);
  ExposureLoop::Level level{1 / std::sqrt(std::max(taken.share, kLeastLight)), taken.share < kLeastLight};
  if (truth.exposure_loop) level = exposure.next(taken.light);
  const double distance = taken.distance_mm;
  if (level.lost || distance <= 0) return invalid(Echo::NoPeak);
  if (distance < setup.start_of_range_mm) return invalid(Echo::BeforeRange);
  if (distance > end) return invalid(Echo::BehindRange);
  double reading = distance - setup.start_of_range_mm;
  const Eigen::Vector3d hit = from + distance * down;
  reading += linearity_error_mm(distance - setup.start_of_range_mm, setup.range_mm, truth.linearity_share);
  if (truth.tilt_error) reading += tilt_error_mm(down, laser.linear().col(0), setup.range_mm);
  if (truth.noise_mm > 0) reading += truth.noise_mm * normal(roll(White)) * level.noise_factor;
  if (truth.speckle_mm > 0) reading += truth.speckle_mm * speckle(hit.x(), hit.y());
  if (uniform(roll(Outlier)) < truth.outlier_share) {
    const double size = uniform(roll(OutlierSize));
    if (size > 0.8) return invalid(Echo::NoPeak);
    reading += (size / 0.4 - 1) * 0.1 * setup.range_mm;
  }
  if (reading < 0) return invalid(Echo::BeforeRange);
  if (reading > setup.range_mm) return invalid(Echo::BehindRange);
  out.distance_mm = reading;
  return out;
}

void LaserDevice::State::finish_block(HostTime last, std::vector<LaserBlock>& out) {
  const double ready_ms = truth.latency_ms + kWire_ms;
  const double jitter_ms =
      -truth.transport_jitter_ms * std::log(1 - uniform(mixed(scene.seed, next, Transport)));
  HostTime arrival = last + from_seconds((ready_ms + jitter_ms) * 1e-3);
  arrival = std::max({arrival, last_arrival, stall_until});
  last_arrival = arrival;
  if (last >= drop_until) out.push_back({arrival, wire.encode(block)});
  block.clear();
}

LaserDevice::LaserDevice(const Scene& scene) : state_(std::make_unique<State>(scene)) {}
LaserDevice::~LaserDevice() = default;

std::vector<LaserBlock> LaserDevice::advance(HostTime now, const PoseAt& pose_at) {
  State& s = *state_;
  std::vector<LaserBlock> out;
  s.now = now;
  for (HostTime t = s.instant(s.next); t <= now; t = s.instant(s.next)) {
    Sample sample = s.measure(s.next, t, pose_at);
    sample.number = s.next - s.number_zero;
    sample.device_ns = s.clock_ns(t + from_seconds(s.truth.latency_ms * 1e-3));
    s.block.push_back(sample);
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
    return state_->meddle_with_clock(fault, duration_s);
  }
  return true;
}

bool LaserDevice::State::meddle_with_clock(const std::string& fault, double by_s) {
  const Nanoseconds by = from_seconds(by_s > 0 ? by_s : 1);
  if (fault == "laser_clock_step") {
    clock_shift_ns += by;
  } else if (fault == "laser_clock_back") {
    clock_shift_ns -= by;
  } else if (fault == "laser_clock_stop") {
    clock_stands_until = now + by;
  } else if (fault == "laser_clock_reset") {
    clock_shift_ns = -free_clock_ns(now);
    number_zero = next;
  } else {
    return false;
  }
  return true;
}

bool LaserDevice::connected() const { return state_->now >= state_->drop_until; }

}  // namespace weldcell::sim
