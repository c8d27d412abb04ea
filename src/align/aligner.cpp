#include "weldcell/align/aligner.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "beam_track.hpp"
#include "device_time.hpp"
#include "weldcell/align/clock_map.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::align {
namespace {

/// One mapping per stretch between resets of a clock.
struct ClockPieces {
  std::vector<ClockMap> maps;
  double skew_ppm = 0, sigma_us = 0;
  std::uint64_t left_out = 0;

  void close(ClockMapBuilder& builder) {
    if (builder.empty()) return;
    maps.push_back(builder.finish());
    builder = ClockMapBuilder{};
    skew_ppm += (maps.back().skew_ppm() - skew_ppm) / static_cast<double>(maps.size());
    sigma_us = std::max(sigma_us, maps.back().sigma_us());
  }
};

ClockPieces map_laser(LaserClock& clock, std::span<const StampedReading> readings) {
  ClockPieces pieces;
  ClockMapBuilder builder;
  for (const StampedReading& r : readings) {
    const auto step = clock.step(r.reading);
    if (!step) continue;
    if (step->restarted) pieces.close(builder);
    builder.add(step->device_ns, r.arrival);
  }
  pieces.close(builder);
  clock.rewind();
  return pieces;
}

ClockPieces map_robot(RobotClock& clock, std::span<const StampedFeedback> poses) {
  ClockPieces pieces;
  ClockMapBuilder builder;
  for (const StampedFeedback& p : poses) {
    const auto step = clock.step(p);
    if (!step) {
      ++pieces.left_out;
      continue;
    }
    if (step->restarted) pieces.close(builder);
    builder.add(step->device_ns, p.arrival);
  }
  pieces.close(builder);
  clock.rewind();
  return pieces;
}

BeamTrack track(const cell::CellSetup& cell, RobotClock& clock, const ClockPieces& pieces,
                std::span<const StampedFeedback> poses) {
  BeamTrack out(cell);
  std::size_t piece = 0;
  HostTime last{std::numeric_limits<Nanoseconds>::min()};
  for (const StampedFeedback& p : poses) {
    const auto step = clock.step(p);
    if (!step) continue;
    if (step->restarted) ++piece;
    const HostTime time = pieces.maps[piece].to_host(step->device_ns) - clock.send_age_ns();
    if (time <= last) continue;
    last = time;
    kinematics::Joints joints{};
    for (std::size_t j = 0; j < joints.size(); ++j) joints[j] = rad(p.feedback.joints_deg[j]);
    out.add(time, joints, step->restarted);
  }
  return out;
}

/// The reading on the beam; for an invalid one the beam meets the plane z = last_height_mm.
SurfacePoint place(const wire::LaserReading& reading, HostTime time, const Beam& beam,
                   double start_of_range_mm, double last_height_mm) {
  const double uz = beam.direction.z();
  const bool valid = reading.code == 0;
  const double along =
      valid ? start_of_range_mm + static_cast<double>(reading.distance_mm)
            : (std::abs(uz) > 1e-6 ? (last_height_mm - beam.origin.z()) / uz : start_of_range_mm);
  const Eigen::Vector3d foot = beam.origin + along * beam.direction;
  // The foot moves over a level surface, so the beam's length changes with it.
  const Eigen::Vector3d rate = beam.origin_rate + along * beam.direction_rate;
  const double lengthening = std::abs(uz) > 1e-6 ? -rate.z() / uz : 0;
  const double receiver = std::hypot(beam.receiver_x, beam.receiver_y);
  SurfacePoint point;
  point.time = time;
  point.x_mm = static_cast<float>(foot.x());
  point.y_mm = static_cast<float>(foot.y());
  point.z_mm = static_cast<float>(foot.z());
  point.vx_mm_s = static_cast<float>(rate.x() + lengthening * beam.direction.x());
  point.vy_mm_s = static_cast<float>(rate.y() + lengthening * beam.direction.y());
  if (receiver > 1e-9) {
    point.receiver_x = static_cast<float>(beam.receiver_x / receiver);
    point.receiver_y = static_cast<float>(beam.receiver_y / receiver);
  }
  point.code = reading.code;
  return point;
}

}  // namespace

std::vector<SurfacePoint> align(const cell::CellSetup& cell, std::span<const StampedReading> readings,
                                std::span<const StampedFeedback> poses, AlignSummary& summary) {
  summary = {};
  std::vector<SurfacePoint> points;
  LaserClock laser_clock(readings, cell.laser.rate_hz);
  RobotClock robot_clock(poses);
  const ClockPieces laser = map_laser(laser_clock, readings);
  const ClockPieces robot = map_robot(robot_clock, poses);
  BeamTrack beams = track(cell, robot_clock, robot, poses);
  summary.laser_skew_ppm = laser.skew_ppm;
  summary.robot_skew_ppm = robot.skew_ppm;
  summary.laser_clock_sigma_us = laser.sigma_us;
  summary.robot_clock_sigma_us = robot.sigma_us;
  for (const ClockPieces* pieces : {&laser, &robot}) {
    if (!pieces->maps.empty()) summary.clock_resets += pieces->maps.size() - 1;
  }

  summary.repeated = robot.left_out;
  if (readings.size() > 1 && readings.back().arrival > readings.front().arrival) {
    const std::uint32_t sent = readings.back().reading.counter - readings.front().reading.counter;
    summary.laser_rate_hz = sent / seconds(readings.back().arrival - readings.front().arrival);
  }

  points.reserve(readings.size());
  const Nanoseconds latency = from_seconds(cell.laser.latency_ms * 1e-3);
  std::size_t piece = 0;
  std::uint64_t missing = 0;
  bool stalled = false;
  double height_mm = cell.table.z_mm;
  HostTime last{std::numeric_limits<Nanoseconds>::min()};
  Beam beam;
  for (const StampedReading& r : readings) {
    const auto step = laser_clock.step(r.reading);
    if (!step) {
      ++summary.repeated;
      continue;
    }
    if (step->restarted) ++piece;
    if (step->stalled && !stalled) ++summary.clock_stalls;
    stalled = step->stalled;
    summary.lost += step->lost;
    missing += step->lost;
    const HostTime time = laser.maps[piece].to_host(step->device_ns) - latency;
    if (time <= last || !beams.at(time, beam)) {
      ++summary.without_pose;
      ++missing;
      continue;
    }
    last = time;
    SurfacePoint point = place(r.reading, time, beam, cell.laser.start_of_range_mm, height_mm);
    if (point.code == 0) {
      height_mm = static_cast<double>(point.z_mm);
    } else {
      ++summary.invalid;
    }
    // Readings before the first pose are no gap in the scan: it had not begun.
    point.gap = points.empty() ? std::uint16_t{0}
                               : static_cast<std::uint16_t>(std::min<std::uint64_t>(missing, 65535));
    missing = 0;
    points.push_back(point);
  }
  summary.points = points.size();
  return points;
}

}  // namespace weldcell::align
