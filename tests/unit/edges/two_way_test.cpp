// From wire clocks to edges: a beam that crosses one edge both ways tells whether the latency's sign and size
// are right.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "weldcell/align/aligner.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/edges/edges.hpp"

namespace weldcell::edges {
namespace {

constexpr std::uint64_t kSeed = 44301;
constexpr double kEdge_mm = 37.5, kHeight_mm = 40, kBlur_mm = 0.275;

cell::CellSetup test_cell() {
  cell::CellSetup cell;
  auto& arm = cell.arm;
  arm.a1 = 150, arm.a2 = -115, arm.c1 = 445, arm.c2 = 700, arm.c3 = 795, arm.c4 = 85;
  arm.offset[2] = rad(-90);
  cell.laser.T_flange_laser.iso.translation() = Eigen::Vector3d(60, 0, 40);
  return cell;
}

/// J1 swings the vertical beam across the line y = kEdge_mm.
kinematics::Joints posture(double t) {
  return {0.25 * std::sin(2 * kPi * t / 4), rad(20), rad(15), 0, rad(55), 0};
}

struct Recording {
  std::vector<align::StampedReading> readings;
  std::vector<align::StampedFeedback> poses;
};

Recording record(const cell::CellSetup& cell, double duration_s, double latency_s, double noise_mm) {
  std::mt19937_64 random(kSeed);
  std::exponential_distribution<double> exponential(1);
  std::normal_distribution<double> normal;
  Recording out;
  double arrival = 0;
  for (std::uint32_t k = 0; k < static_cast<std::uint32_t>(5000 * duration_s); ++k) {
    const double stamped = k / 5000.0 / (1 + 30e-6), t = stamped - latency_s;
    const auto beam = (kinematics::forward(cell.arm, posture(t)) * cell.laser.T_flange_laser).position_mm();
    const double rise = kHeight_mm * 0.5 * std::erfc((kEdge_mm - beam.y()) / kBlur_mm / std::sqrt(2.0));
    if (k % 20 == 0)
      arrival = std::max(arrival, (k + 19) / 5000.0 / (1 + 30e-6) + 0.25e-3 + 0.3e-3 * exponential(random));
    align::StampedReading r;
    r.arrival = HostTime{from_seconds(arrival)};
    r.reading.counter = k;
    r.reading.timestamp_us = 1'000'000 + k * 200;
    r.reading.distance_mm = static_cast<float>(beam.z() - cell.table.z_mm - rise -
                                               cell.laser.start_of_range_mm + noise_mm * normal(random));
    out.readings.push_back(r);
  }
  for (std::uint32_t k = 0; k * 4e-3 < duration_s; ++k) {
    align::StampedFeedback p;
    const double t = k * 4e-3;
    const auto q = posture(t);
    for (std::size_t j = 0; j < 6; ++j) p.feedback.joints_deg[j] = deg(q[j]);
    p.feedback.seqno = k;
    p.feedback.time_us = 5'000'000 + std::llround(1e6 * t * (1 - 15e-6));
    p.arrival = HostTime{from_seconds(t + 0.25e-3 + 0.2e-3 * exponential(random))};
    out.poses.push_back(p);
  }
  return out;
}

/// Mean place of the rising (towards +y) and of the falling (back) crossings along y, and the speed.
struct Split {
  double rising_mm = 0, falling_mm = 0, speed_mm_s = 0;
  int crossings = 0;
};

Split split(const cell::CellSetup& cell, const Recording& recording) {
  align::AlignSummary summary;
  EdgeOptions options;
  options.height_mm = kHeight_mm;
  const auto points = align::align(cell, recording.readings, recording.poses, summary);
  const EdgeScan scan = detect(points, options);
  Split out;
  double rising = 0, falling = 0;
  for (const EdgePoint& e : scan.edges) {
    (e.step > 0 ? out.rising_mm : out.falling_mm) += e.y_mm;
    (e.step > 0 ? rising : falling) += 1;
    out.speed_mm_s += e.speed_mm_s;
    EXPECT_EQ(e.step, e.dir_y > 0 ? 1 : -1);
  }
  out.crossings = static_cast<int>(rising + falling);
  out.rising_mm /= rising;
  out.falling_mm /= falling;
  out.speed_mm_s /= out.crossings;
  return out;
}

TEST(TwoWay, CrossingsAgreeWhenTheLatencyIsRight) {
  cell::CellSetup cell = test_cell();
  const Recording recording = record(cell, 16, 2.7e-3, 0);
  cell.laser.latency_ms = 2.7;
  const Split right = split(cell, recording);
  EXPECT_EQ(right.crossings, 8);
  std::printf("%.0f mm/s, %d crossings: split %.5f mm, place %.5f mm\n", right.speed_mm_s, right.crossings,
              right.rising_mm - right.falling_mm, 0.5 * (right.rising_mm + right.falling_mm) - kEdge_mm);
  EXPECT_LE(std::abs(right.rising_mm - right.falling_mm), right.speed_mm_s * 1e-6);
  EXPECT_NEAR(0.5 * (right.rising_mm + right.falling_mm), kEdge_mm, 1e-3);
}

TEST(TwoWay, AWrongLatencySplitsThemBySpeedTimesError) {
  cell::CellSetup cell = test_cell();
  const Recording recording = record(cell, 16, 2.7e-3, 0.1);
  for (const double configured_ms : {0.0, 1.7, 3.7}) {
    cell.laser.latency_ms = configured_ms;
    const Split wrong = split(cell, recording);
    // Too small a latency places a reading later, that is farther along the travel, than it was taken.
    const double expected = 2 * wrong.speed_mm_s * (2.7 - configured_ms) * 1e-3;
    EXPECT_NEAR(wrong.rising_mm - wrong.falling_mm, expected, 0.01 * std::abs(expected) + 0.02);
  }
}

}  // namespace
}  // namespace weldcell::edges
