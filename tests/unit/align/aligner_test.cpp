#include "weldcell/align/aligner.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "weldcell/base/units.hpp"

namespace weldcell::align {
namespace {

constexpr std::uint64_t kSeed = 43101;

cell::CellSetup test_cell() {
  cell::CellSetup cell;
  auto& arm = cell.arm;
  arm.a1 = 150, arm.a2 = -115, arm.c1 = 445, arm.c2 = 700, arm.c3 = 795, arm.c4 = 85;
  arm.offset[2] = rad(-90);
  arm.lower.fill(-7);
  arm.upper.fill(7);
  cell.laser.T_flange_laser.iso.translation() = Eigen::Vector3d(60, 0, 40);
  cell.laser.latency_ms = 2.7;
  return cell;
}

/// A recorded scan made from a known motion: J1 swings so that the beam goes back and forth over the table.
struct Motion {
  double period_s = 4, swing_rad = 0.25;
  kinematics::Joints at(double t) const {
    return {swing_rad * std::sin(2 * kPi * t / period_s), rad(20), rad(15) + 0.02 * std::sin(1.3 * t), 0,
            rad(55) - 0.02 * std::sin(1.3 * t),           0};
  }
};

struct Recording {
  std::vector<StampedReading> readings;
  std::vector<StampedFeedback> poses;
  std::vector<double> true_time_s;  ///< of each reading's mid-exposure
};

struct Truth {
  double duration_s = 8, rate_hz = 5000, latency_s = 2.7e-3;
  double laser_ppm = 30, robot_ppm = -15, laser_zero_s = 12.3, robot_zero_s = 28397.2;
  double laser_floor_s = 0, robot_floor_s = 0, jitter_s = 0.3e-3;
  bool timestamps = true, feedback_time = true;
  double stall_every_s = 0, stall_s = 0;
};

Transform<Base, Laser> beam_at(const cell::CellSetup& cell, const kinematics::Joints& q) {
  return kinematics::forward(cell.arm, q) * cell.laser.T_flange_laser;
}

Recording record(const cell::CellSetup& cell, const Motion& motion, const Truth& truth,
                 std::mt19937_64& random) {
  std::exponential_distribution<double> exponential(1);
  Recording out;
  const auto late = [&](double t) {
    if (truth.stall_every_s <= 0) return t;
    const double phase = std::fmod(t, truth.stall_every_s);
    return phase < truth.stall_s ? t + truth.stall_s - phase : t;
  };
  const auto block = static_cast<std::uint32_t>(truth.rate_hz * 4e-3);
  double arrival = 0;
  std::vector<StampedReading> waiting;
  for (std::uint32_t k = 0; k < static_cast<std::uint32_t>(truth.duration_s * truth.rate_hz); ++k) {
    const double device = (k + 0.5) / truth.rate_hz;  // the sensor samples by its own clock
    const double stamped = device / (1 + 1e-6 * truth.laser_ppm), t = stamped - truth.latency_s;
    const auto beam = beam_at(cell, motion.at(t));
    const double length = (cell.table.z_mm - beam.position_mm().z()) / beam.rotation()(2, 2);
    StampedReading r;
    r.reading.distance_mm = static_cast<float>(length - cell.laser.start_of_range_mm);
    r.reading.counter = 4294960000U + k;
    if (truth.timestamps) {
      r.reading.timestamp_us = static_cast<std::uint32_t>(
          static_cast<std::uint64_t>(std::llround(1e6 * (device + truth.laser_zero_s))));
    }
    out.true_time_s.push_back(t);
    waiting.push_back(r);
    if (waiting.size() == block) {
      arrival = std::max(arrival, late(stamped + truth.laser_floor_s + truth.jitter_s * exponential(random)));
      for (auto& w : waiting) {
        w.arrival = HostTime{from_seconds(arrival)};
        out.readings.push_back(w);
      }
      waiting.clear();
    }
  }
  double last = 0;
  for (std::uint32_t k = 0; k * 4.032e-3 < truth.duration_s; ++k) {
    const double t = k * 4.032e-3;
    StampedFeedback p;
    const auto q = motion.at(t);
    for (std::size_t j = 0; j < 6; ++j) p.feedback.joints_deg[j] = deg(q[j]);
    const double device = truth.robot_zero_s + t * (1 + 1e-6 * truth.robot_ppm);
    p.feedback.seqno = k;
    p.feedback.time_us = truth.feedback_time ? static_cast<std::int64_t>(std::llround(1e6 * device)) : -1;
    p.feedback.tm_ms = static_cast<std::uint32_t>(device * 1e3);
    last = std::max(last, late(t + truth.robot_floor_s + truth.jitter_s * exponential(random)));
    p.arrival = HostTime{from_seconds(last)};
    out.poses.push_back(p);
  }
  return out;
}

struct Outcome {
  double time_mean_us = 0, time_std_us = 0, place_mm = 0, velocity_mm_s = 0;
};

/// Every point against the truth at its reading's own instant.
Outcome compare(const cell::CellSetup& cell, const Motion& motion, const Recording& recording,
                const std::vector<SurfacePoint>& points) {
  Outcome out;
  double n = 0, sum = 0, square = 0;
  std::size_t k = 0;
  for (const SurfacePoint& p : points) {
    const double at = seconds(p.time - HostTime{0});
    while (k + 1 < recording.true_time_s.size() &&
           std::abs(recording.true_time_s[k + 1] - at) < std::abs(recording.true_time_s[k] - at)) {
      ++k;
    }
    const double t = recording.true_time_s[k], e = 1e6 * (at - t);
    n += 1, sum += e, square += e * e;
    const auto foot = [&](double when) {
      const auto beam = beam_at(cell, motion.at(when));
      const double length = (cell.table.z_mm - beam.position_mm().z()) / beam.rotation()(2, 2);
      return Eigen::Vector3d((beam * Point<Laser>{{0, 0, length}}).mm);
    };
    const Eigen::Vector3d truth = foot(t), rate = (foot(t + 1e-5) - foot(t - 1e-5)) / 2e-5;
    out.place_mm = std::max(out.place_mm, std::hypot(static_cast<double>(p.x_mm) - truth.x(),
                                                     static_cast<double>(p.y_mm) - truth.y()));
    out.velocity_mm_s = std::max(out.velocity_mm_s, std::hypot(static_cast<double>(p.vx_mm_s) - rate.x(),
                                                               static_cast<double>(p.vy_mm_s) - rate.y()));
  }
  out.time_mean_us = sum / n;
  out.time_std_us = std::sqrt(std::max(0.0, square / n - out.time_mean_us * out.time_mean_us));
  return out;
}

TEST(Align, PlacesEveryReadingWhereItWasTaken) {
  std::mt19937_64 random(kSeed);
  const cell::CellSetup cell = test_cell();
  const Motion motion;
  for (const bool timestamps : {true, false}) {
    for (const bool feedback_time : {true, false}) {
      Truth truth;
      truth.timestamps = timestamps;
      truth.feedback_time = feedback_time;
      truth.stall_every_s = 1.7;
      truth.stall_s = 0.05;
      const Recording recording = record(cell, motion, truth, random);
      AlignSummary summary;
      const auto points = align(cell, recording.readings, recording.poses, summary);
      const Outcome outcome = compare(cell, motion, recording, points);
      std::printf(
          "stamps %d feedback time %d: time %+.1f +- %.2f us, place %.4f mm, velocity %.3f mm/s, sigma %.2f "
          "/ %.2f us\n",
          timestamps, feedback_time, outcome.time_mean_us, outcome.time_std_us, outcome.place_mm,
          outcome.velocity_mm_s, summary.laser_clock_sigma_us, summary.robot_clock_sigma_us);
      EXPECT_EQ(summary.points, points.size());
      EXPECT_EQ(summary.lost, 0U);
      EXPECT_EQ(summary.clock_resets, 0U);
      EXPECT_GT(points.size(), recording.readings.size() - 100);
      EXPECT_NEAR(summary.laser_skew_ppm, -30, 1.5);
      EXPECT_LE(outcome.time_std_us, 20);
      EXPECT_LE(std::abs(outcome.time_mean_us), 20);
      // tm tells the sending instant in whole ms: half a millisecond of constant is left to the latency.
      EXPECT_LE(outcome.place_mm, feedback_time ? 0.01 : 0.5);
      EXPECT_LE(outcome.velocity_mm_s, feedback_time ? 0.5 : 1.0);
    }
  }
}

TEST(Align, InvalidReadingsKeepTheirPlaceAndLossesShow) {
  std::mt19937_64 random(kSeed + 1);
  const cell::CellSetup cell = test_cell();
  const Motion motion;
  Truth truth;
  truth.duration_s = 2;
  Recording recording = record(cell, motion, truth, random);
  for (std::size_t i = 4000; i < 4050; ++i) {
    recording.readings[i].reading.code = 0x7FFFFFFBU;
    recording.readings[i].reading.distance_mm = 1e9F;
  }
  recording.readings.erase(recording.readings.begin() + 6000, recording.readings.begin() + 6020);
  AlignSummary summary;
  const auto points = align(cell, recording.readings, recording.poses, summary);
  EXPECT_EQ(summary.invalid, 50U);
  EXPECT_EQ(summary.lost, 20U);
  EXPECT_EQ(summary.clock_resets, 0U);
  std::size_t gaps = 0;
  double widest = 0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    gaps += points[i].gap;
    if (points[i].gap == 0) {
      widest = std::max(widest, std::hypot(static_cast<double>(points[i].x_mm - points[i - 1].x_mm),
                                           static_cast<double>(points[i].y_mm - points[i - 1].y_mm)));
    }
  }
  EXPECT_EQ(gaps, 20U);
  EXPECT_LT(widest, 0.5);  // no drop-out jumps away
}

TEST(Align, WrapsAndResetsOfTheLaserClock) {
  std::mt19937_64 random(kSeed + 2);
  const cell::CellSetup cell = test_cell();
  const Motion motion;
  Truth truth;
  truth.duration_s = 6;
  truth.laser_zero_s = 4294.967296 - 3;  // the stamp wraps in the middle
  Recording recording = record(cell, motion, truth, random);
  AlignSummary summary;
  auto points = align(cell, recording.readings, recording.poses, summary);
  EXPECT_EQ(summary.clock_resets, 0U);
  EXPECT_LE(compare(cell, motion, recording, points).place_mm, 0.02);

  for (std::size_t i = recording.readings.size() / 2; i < recording.readings.size(); ++i) {
    recording.readings[i].reading.timestamp_us += 777'000;  // a step forward
  }
  points = align(cell, recording.readings, recording.poses, summary);
  EXPECT_EQ(summary.clock_resets, 1U);
  EXPECT_LE(compare(cell, motion, recording, points).place_mm, 0.05);

  for (std::size_t i = recording.readings.size() / 2; i < recording.readings.size(); ++i) {
    recording.readings[i].reading.timestamp_us -= 4'000'000'000U;
    recording.readings[i].reading.counter -= 4'294'960'000U;  // the sensor was restarted
  }
  points = align(cell, recording.readings, recording.poses, summary);
  EXPECT_EQ(summary.clock_resets, 1U);
  EXPECT_LE(compare(cell, motion, recording, points).place_mm, 0.05);
}

TEST(Align, RobotClockResetAndMissingPoses) {
  std::mt19937_64 random(kSeed + 3);
  const cell::CellSetup cell = test_cell();
  const Motion motion;
  Truth truth;
  truth.duration_s = 6;
  Recording recording = record(cell, motion, truth, random);
  for (std::size_t i = 700; i < recording.poses.size(); ++i)
    recording.poses[i].feedback.time_us -= 20'000'000'000;
  recording.poses.erase(recording.poses.begin() + 200, recording.poses.begin() + 205);  // bridged
  recording.poses.erase(recording.poses.begin() + 400, recording.poses.begin() + 450);  // not bridged
  AlignSummary summary;
  const auto points = align(cell, recording.readings, recording.poses, summary);
  EXPECT_EQ(summary.clock_resets, 1U);
  EXPECT_NEAR(static_cast<double>(summary.without_pose), 5000 * 51 * 4.032e-3 + 20, 60);
  EXPECT_LE(compare(cell, motion, recording, points).place_mm, 0.05);
}

TEST(Align, EmptyAndDegenerateRecordsAreNoPoints) {
  const cell::CellSetup cell = test_cell();
  AlignSummary summary;
  EXPECT_TRUE(align(cell, {}, {}, summary).empty());
  std::vector<StampedReading> one(1);
  std::vector<StampedFeedback> pose(1);
  EXPECT_TRUE(align(cell, one, {}, summary).empty());
  EXPECT_TRUE(align(cell, {}, pose, summary).empty());
  EXPECT_TRUE(align(cell, one, pose, summary).empty());
}

/// Every reading by its name, carried in the error word: an invalid reading keeps its place on the table.
double worst_named_place_mm(const cell::CellSetup& cell, const Motion& motion, const Recording& recording,
                            const std::vector<SurfacePoint>& points) {
  double worst = 0;
  for (const SurfacePoint& p : points) {
    const auto beam = beam_at(cell, motion.at(recording.true_time_s[p.code - 1]));
    const double length = (cell.table.z_mm - beam.position_mm().z()) / beam.rotation()(2, 2);
    const Eigen::Vector3d truth = (beam * Point<Laser>{{0, 0, length}}).mm;
    worst = std::max(
        worst, std::hypot(static_cast<double>(p.x_mm) - truth.x(), static_cast<double>(p.y_mm) - truth.y()));
  }
  return worst;
}

enum class Trouble {
  LaserSteps,
  LaserGoesBack,
  LaserStands,       // and goes on from where it stood
  LaserStandsLeaps,  // and goes on as if it had not stood
  LaserCountStands,  // and leaps at its end
  LaserRestarts,
  LaserWraps,
  ReadingsTwice,
  RobotSteps,
  RobotGoesBack,
  RobotStands,
  RobotRestarts,
};

/// The trouble begins at `at_s` and has the size `size_s`.
void trouble(Recording& recording, Trouble kind, double at_s, double size_s) {
  const auto us = static_cast<std::uint32_t>(std::llround(size_s * 1e6));
  std::uint32_t stamp_there = 0, count_there = 0;
  std::int64_t time_there = 0;
  for (std::size_t k = 0; k < recording.readings.size(); ++k) {
    auto& r = recording.readings[k].reading;
    const double since_s = recording.true_time_s[k] - at_s;
    if (since_s < 0) {
      stamp_there = r.timestamp_us;
      count_there = r.counter;
      continue;
    }
    const bool during = since_s < size_s;
    switch (kind) {
      case Trouble::LaserSteps:
        r.timestamp_us += us;
        break;
      case Trouble::LaserGoesBack:
        r.timestamp_us -= us;
        break;
      case Trouble::LaserStands:
        r.timestamp_us = during ? stamp_there : r.timestamp_us - us;
        break;
      case Trouble::LaserStandsLeaps:
        if (during) r.timestamp_us = stamp_there;
        break;
      case Trouble::LaserCountStands:
        if (during) r.counter = count_there;
        break;
      case Trouble::LaserRestarts:
        r.timestamp_us -= stamp_there;
        r.counter -= count_there;
        break;
      default:
        break;
    }
  }
  for (auto& p : recording.poses) {
    const double since_s = seconds(p.arrival - HostTime{0}) - at_s;
    if (since_s < 0) {
      time_there = p.feedback.time_us;
      continue;
    }
    if (kind == Trouble::RobotSteps) p.feedback.time_us += us;
    if (kind == Trouble::RobotGoesBack) p.feedback.time_us -= us;
    if (kind == Trouble::RobotStands)
      p.feedback.time_us = since_s < size_s ? time_there : p.feedback.time_us - us;
    if (kind == Trouble::RobotRestarts) p.feedback.time_us -= time_there;
    p.feedback.tm_ms = static_cast<std::uint32_t>(p.feedback.time_us / 1000);
  }
  if (kind == Trouble::ReadingsTwice) {
    const auto from = recording.readings.begin() + static_cast<std::ptrdiff_t>(at_s * 5000);
    const std::vector<StampedReading> again(from, from + 1);
    recording.readings.insert(from + 1, static_cast<std::size_t>(size_s * 5000), again.front());
  }
}

TEST(Align, EveryTroubleOfAClockIsRecognizedAndMovesNoPoint) {
  const cell::CellSetup cell = test_cell();
  std::mt19937_64 random(kSeed + 9);
  std::uniform_real_distribution<double> uniform;
  for (int kind_number = 0; kind_number <= static_cast<int>(Trouble::RobotRestarts); ++kind_number) {
    const auto kind = static_cast<Trouble>(kind_number);
    double worst = 0;
    std::size_t fewest = 100'000;
    for (int trial = 0; trial < 8; ++trial) {
      SCOPED_TRACE(testing::Message() << "trouble " << kind_number << " trial " << trial);
      const Motion motion{3 + 2 * uniform(random), 0.15 + 0.1 * uniform(random)};
      Truth truth;
      truth.duration_s = 5;
      truth.stall_every_s = 1.7;
      truth.stall_s = 0.05;
      const double at_s = 1.5 + 2 * uniform(random), size_s = 0.02 * std::pow(50, uniform(random));
      if (kind == Trouble::LaserWraps) truth.laser_zero_s = 4294.967296 - at_s;
      Recording recording = record(cell, motion, truth, random);
      for (std::size_t k = 0; k < recording.readings.size(); ++k)
        recording.readings[k].reading.code = static_cast<std::uint32_t>(k + 1);
      trouble(recording, kind, at_s, size_s);
      AlignSummary summary;
      const auto points = align(cell, recording.readings, recording.poses, summary);
      worst = std::max(worst, worst_named_place_mm(cell, motion, recording, points));
      fewest = std::min(fewest, points.size());
      const bool stands = kind == Trouble::LaserStands || kind == Trouble::LaserStandsLeaps;
      EXPECT_EQ(summary.clock_stalls, stands ? 1U : 0U);
      const bool goes_on =
          kind == Trouble::LaserStands || kind == Trouble::LaserWraps || kind == Trouble::ReadingsTwice;
      if (goes_on) {
        EXPECT_EQ(summary.clock_resets, 0U);
      } else {
        EXPECT_GE(summary.clock_resets, 1U);
        EXPECT_LE(summary.clock_resets, 2U);
      }
      const bool left_out = kind == Trouble::ReadingsTwice || kind == Trouble::RobotStands;
      EXPECT_EQ(summary.repeated > 0, left_out || (kind == Trouble::RobotGoesBack && size_s < 0.1))
          << summary.repeated;
    }
    std::printf("trouble %2d: worst place %.4f mm, at least %zu of 25000 readings placed\n", kind_number,
                worst, fewest);
    EXPECT_LE(worst, 0.1) << kind_number;
    EXPECT_GT(fewest, 19'000U) << kind_number;  // a robot's clock that stands a second costs that second
  }
}

}  // namespace
}  // namespace weldcell::align
