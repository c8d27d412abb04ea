#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "bench/robot/parts.hpp"
#include "bench/robot/track.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/plan/scan_plan.hpp"

namespace weldcell::bench {

namespace {

constexpr double kTop_mm = 540;

plan::BeamPath archimedean(double pitch_mm, double from_mm, double to_mm) {
  plan::BeamPath path;
  path.name = "spiral";
  const double b = pitch_mm / (2 * kPi);
  for (double turn = from_mm / b; turn < to_mm / b; turn += 1 / std::max(4.0, b * turn)) {
    path.points.push_back({950 + b * turn * std::cos(turn), b * turn * std::sin(turn)});
  }
  return path;
}

plan::MotionPlan planned(const cell::CellSetup& cell, const std::vector<plan::BeamPath>& paths,
                         double speed_mm_s) {
  auto plan = plan::plan_scan(cell, paths, kTop_mm, speed_mm_s, cell.home);
  if (!plan.ok()) {
    std::fprintf(stderr, "bench_robot: %s\n", plan.error().text().c_str());
    std::exit(2);
  }
  plan->id = 1;
  return std::move(*plan);
}

}  // namespace

void tracking(std::vector<Row>& rows, const files::CellConfig& config) {
  const auto spiral = planned(config.setup, {archimedean(5, 10, 100)}, 100);
  const auto wide = planned(config.setup, {archimedean(40, 30, 250)}, 100);
  const struct {
    const char* name;
    const plan::MotionPlan* plan;
  } spirals[] = {{"spiral pitch 5, r 10-100", &spiral}, {"spiral pitch 40, r 30-250", &wide}};
  for (const auto& s : spirals) {
    const Ride stiff = Track(config, {20, 100}, kTop_mm).follow(*s.plan);
    const Ride soft = Track(config, {5, 20}, kTop_mm).follow(*s.plan);
    const std::string at = std::string(s.name) + " at 100 mm/s, ";
    rows.push_back(
        {at + "contour error k 20 LP 100", stiff.finished ? stiff.contour_mm : 1e9, "mm", NAN, 0.05});
    rows.push_back({at + "contour error k 5 LP 20", soft.finished ? soft.contour_mm : 1e9, "mm", NAN, 0.3});
  }
  plan::BeamPath line;
  line.name = "line";
  line.points = {{950, -150}, {950, 150}};
  const auto straight = planned(config.setup, {line}, 200);
  for (const double cycle_ms : {4.0, 4.032}) {
    const Ride ride = Track(config, {20, 100, cycle_ms}, kTop_mm).follow(straight);
    const std::string at = "line 300 mm at 200 mm/s, cycle " + number(cycle_ms) + " ms, ";
    rows.push_back(
        {at + "contour error", ride.finished ? ride.contour_mm : 1e9, "mm", NAN, NAN, Better::None});
    rows.push_back({at + "highest share of a speed limit", ride.speed, "", NAN, 1});
    rows.push_back({at + "of an acceleration limit", ride.acceleration, "", NAN, 1});
    rows.push_back({at + "of a jerk limit", ride.jerk, "", NAN, 1});
    rows.push_back({at + "of a joint's range", ride.range, "", NAN, 1});
    rows.push_back({at + "references cut", static_cast<double>(ride.limited), "", NAN, 0});
  }
  const Ride stop = Track(config, {20, 100}, kTop_mm).follow(straight, straight.duration_s() / 2);
  rows.push_back(
      {"stop at 200 mm/s, way of the reference", stop.stop_reference_mm, "mm", NAN, NAN, Better::None});
  rows.push_back({"stop at 200 mm/s, way of the arm", stop.stop_arm_mm, "mm", NAN, NAN, Better::None});
  rows.push_back({"stop at 200 mm/s, off the planned path", stop.stop_off_path_mm, "mm", NAN, 0.05});
  rows.push_back({"stop at 200 mm/s, highest share of a jerk limit", stop.jerk, "", NAN, NAN, Better::None});
}

}  // namespace weldcell::bench
