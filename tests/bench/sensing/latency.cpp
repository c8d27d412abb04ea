// Damage and latency: the streams of every dialect with bad bytes, and a gauge bar crossed to and fro.
#include <cmath>
#include <random>
#include <string>

#include "bench/sensing/parts.hpp"
#include "unit/wire/laser_damage.hpp"
#include "weldcell/align/aligner.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/calibrate/latency.hpp"
#include "weldcell/edges/edges.hpp"

namespace weldcell::bench {
namespace {

constexpr std::uint64_t kSeed = 47401;
constexpr double kEdge_mm = 37.5, kHeight_mm = 40, kBlur_mm = 0.275;

cell::CellSetup gauge_cell() {
  cell::CellSetup cell;
  auto& arm = cell.arm;
  arm.a1 = 150, arm.a2 = -115, arm.c1 = 445, arm.c2 = 700, arm.c3 = 795, arm.c4 = 85;
  arm.offset[2] = rad(-90);
  cell.laser.T_flange_laser.iso.translation() = Eigen::Vector3d(60, 0, 40);
  cell.laser.latency_ms = 0;
  return cell;
}

/// J1 swings the vertical beam across the line y = kEdge_mm, so many seconds to and fro.
kinematics::Joints posture(double t, double period_s) {
  return {0.25 * std::sin(2 * kPi * t / period_s), rad(20), rad(15), 0, rad(55), 0};
}

/// Crossings of one recording, made with the latency and seen without it: a bias moves each along its travel.
void add_crossings(double period_s, double latency_s, double bias_mm, std::uint64_t seed,
                   std::vector<calibrate::GaugeCrossing>& out) {
  const cell::CellSetup cell = gauge_cell();
  const double duration_s = 3.2 * period_s;
  std::mt19937_64 random(seed);
  std::exponential_distribution<double> exponential(1);
  std::normal_distribution<double> normal;
  std::vector<align::StampedReading> readings;
  double arrival = 0;
  for (std::uint32_t k = 0; k < static_cast<std::uint32_t>(5000 * duration_s); ++k) {
    const double stamped = k / 5000.0 / (1 + 30e-6), t = stamped - latency_s;
    const auto beam =
        (kinematics::forward(cell.arm, posture(t, period_s)) * cell.laser.T_flange_laser).position_mm();
    const double rise = kHeight_mm * 0.5 * std::erfc((kEdge_mm - beam.y()) / kBlur_mm / std::sqrt(2.0));
    if (k % 20 == 0)
      arrival = std::max(arrival, (k + 19) / 5000.0 / (1 + 30e-6) + 0.25e-3 + 0.3e-3 * exponential(random));
    align::StampedReading r;
    r.arrival = HostTime{from_seconds(arrival)};
    r.reading.counter = k;
    r.reading.timestamp_us = 1'000'000 + k * 200;
    r.reading.distance_mm = static_cast<float>(beam.z() - cell.table.z_mm - rise -
                                               cell.laser.start_of_range_mm + 0.1 * normal(random));
    readings.push_back(r);
  }
  std::vector<align::StampedFeedback> poses;
  for (std::uint32_t k = 0; k * 4e-3 < duration_s; ++k) {
    align::StampedFeedback p;
    const double t = k * 4e-3;
    const auto q = posture(t, period_s);
    for (std::size_t j = 0; j < 6; ++j) p.feedback.joints_deg[j] = deg(q[j]);
    p.feedback.seqno = k;
    p.feedback.time_us = 5'000'000 + std::llround(1e6 * t * (1 - 15e-6));
    p.arrival = HostTime{from_seconds(t + 0.25e-3 + 0.2e-3 * exponential(random))};
    poses.push_back(p);
  }
  align::AlignSummary summary;
  edges::EdgeOptions options;
  options.height_mm = kHeight_mm;
  for (const EdgePoint& e : edges::detect(align::align(cell, readings, poses, summary), options).edges) {
    calibrate::GaugeCrossing c;
    c.direction = e.dir_y > 0 ? 1 : -1;
    c.across_mm = e.y_mm + c.direction * bias_mm;
    c.speed_mm_s = e.speed_mm_s;
    c.sigma_mm = 0.02;
    out.push_back(c);
  }
}

}  // namespace

void damage_rows(std::vector<Row>& rows) {
  using wire::LaserDialect;
  for (const auto dialect : {LaserDialect::Meas28, LaserDialect::Data28, LaserDialect::Meas32,
                             LaserDialect::TwoByte, LaserDialect::ThreeByte, LaserDialect::Od5000}) {
    std::size_t lost = 0, sound = 0;
    for (unsigned seed = 1; seed <= 60; ++seed) {
      const wire::streams::Damage d = wire::streams::damage(dialect, seed);
      lost += d.sound_lost;
      sound += d.sound;
    }
    const bool tried = sound > 60 * 700;
    rows.push_back({std::string("sound readings lost, 1 % of bytes damaged, ") + wire::to_string(dialect),
                    tried ? static_cast<double>(lost) : NAN, "readings", static_cast<double>(sound), 0});
  }
}

void latency_rows(std::vector<Row>& rows) {
  double worst_ms = 0, covered = 0;
  int fits = 0, refused = 0, one_speed = 0, worded = 0;
  for (const double latency_ms : {0.0, 0.5, 1.0, 2.7, 5.0, 10.0}) {
    for (std::uint64_t trial = 0; trial < 4; ++trial) {
      std::vector<calibrate::GaugeCrossing> three, one;
      std::uint64_t seed = kSeed + 100 * trial;
      for (const double period_s : {3.0, 5.0, 9.0})
        add_crossings(period_s, 1e-3 * latency_ms, 0.05, ++seed, three);
      const auto fit = calibrate::fit_latency(three);
      if (fit.ok()) {
        const double error_ms = std::abs(fit->latency_ms - latency_ms);
        worst_ms = std::max(worst_ms, error_ms);
        covered += error_ms <= 2 * fit->sigma_ms() ? 1 : 0;
        ++fits;
      } else {
        ++refused;
      }
      if (trial > 0) continue;
      for (int again = 0; again < 3; ++again) add_crossings(5, 1e-3 * latency_ms, 0.05, ++seed, one);
      ++one_speed;
      const auto told = calibrate::fit_latency(one);
      worded += !told.ok() && told.error().text().find("speed") != std::string::npos ? 1 : 0;
    }
  }
  rows.push_back({"latency 0 to 10 ms, 3 speeds to and fro: worst error", worst_ms, "ms", NAN, 0.1});
  rows.push_back({"gauge scans of 3 speeds refused", static_cast<double>(refused), "scans",
                  static_cast<double>(fits + refused), 0});
  rows.push_back({"stated latency uncertainty (2 sigma) covers", 100 * covered / std::max(1, fits), "%", NAN,
                  NAN, Better::None});
  rows.push_back({"gauge scans of one speed refused with the reason", 100.0 * worded / one_speed, "%", NAN,
                  100, Better::Higher});
}

}  // namespace weldcell::bench
