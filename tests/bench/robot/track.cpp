#include "bench/robot/track.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "egm.pb.h"
#include "weldcell/base/units.hpp"
#include "weldcell/weld/resident.hpp"

namespace weldcell::bench {

using kinematics::Joints;

namespace {

std::string text_of(const std::string& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Where the beam meets the plane of the part's top.
Eigen::Vector3d foot(const cell::CellSetup& cell, const Joints& q, double top_z_mm) {
  const auto laser = kinematics::forward(cell.arm, q).iso * cell.laser.T_flange_laser.iso;
  const Eigen::Vector3d at = laser.translation(), along = laser.linear().col(2);
  return at + (top_z_mm - at.z()) / along.z() * along;
}

/// The cell file states the filter that the RAPID module asks for.
cell::CellSetup setup_of(const files::CellConfig& config, const Law& law) {
  cell::CellSetup cell = config.setup;
  cell.egm.low_pass_hz = law.low_pass_hz;
  return cell;
}
sim::Scene scene_of(const files::CellConfig& config, const Law& law) {
  sim::Scene scene;
  scene.cell = config;
  scene.controller.position_gain = law.gain;
  scene.controller.low_pass_hz = law.low_pass_hz;
  scene.controller.cycle_ms = law.cycle_ms;
  return scene;
}

std::string module_of(const cell::CellSetup& cell) {
  const auto filled = weld::fill_resident(text_of(WELDCELL_CONFIG "/rapid/WeldcellEgm.mod"), cell);
  if (!filled.ok()) {
    std::fprintf(stderr, "bench_robot: %s\n", filled.error().text().c_str());
    std::exit(2);
  }
  return *filled;
}

}  // namespace

Track::Track(const files::CellConfig& config, const Law& law, double top_z_mm)
    : cell_(setup_of(config, law)),
      top_(top_z_mm),
      scene_(scene_of(config, law)),
      controller_(scene_, cell_.arm),
      transport_(controller_),
      rws_(transport_),
      runner_(rws_, config.rws_task, module_of(cell_)),
      session_(cell_) {}

void Track::open(const plan::MotionPlan& plan) {
  for (const auto& sample : plan.samples) way_.push_back(foot(cell_, sample.q, top_));
  job::RobotRequest request;
  request.id = 1;
  request.task = job::RobotTask::OpenScan;
  request.joints = plan.samples.front().q;
  runner_.begin(request, now_);
  while (!controller_.egm_guiding() && seconds(now_.ns) < 120) {
    cycle();
    if (const auto reply = runner_.step(now_); reply && !reply->ok)
      std::fprintf(stderr, "bench_robot: %s\n", reply->text.c_str());
  }
  for (int k = 0; k < 50; ++k) cycle();
}

Ride Track::follow(const plan::MotionPlan& plan, double stop_s) {
  open(plan);
  session_.set_armed(true);
  session_.offer(&plan);
  judge_ = std::make_unique<Judge>(cell_);
  Ride out;
  const double end_s = plan.duration_s() + 5, begin_s = seconds(now_.ns);
  bool stopped = false;
  Eigen::Vector3d arm_at_stop = Eigen::Vector3d::Zero();
  while (seconds(now_.ns) - begin_s < end_s) {
    cycle();
    const auto& report = session_.report();
    const Eigen::Vector3d arm = foot(cell_, controller_.joints(), top_);
    const double t = report.plan_time_s;
    if (stop_s >= 0 && !stopped && t >= stop_s) {
      session_.request_stop();
      stopped = true;
      arm_at_stop = arm;
      reference_way_ = 0;
    }
    if (stopped) out.stop_off_path_mm = std::max(out.stop_off_path_mm, off_way(arm, t, plan));
    for (const auto& pass : plan.passes) {
      if (!stopped && t > pass.from_s + 0.1 && t < pass.to_s)
        out.contour_mm = std::max(out.contour_mm, off_way(arm, t, plan));
    }
    if (report.plan_done || (stopped && report.phase == robot::EgmPhase::Holding)) {
      out.finished = report.plan_done;
      break;
    }
  }
  out.stop_reference_mm = reference_way_;
  for (int k = 0; k < 150; ++k) cycle();
  if (stopped) out.stop_arm_mm = (foot(cell_, controller_.joints(), top_) - arm_at_stop).norm();
  out.speed = judge_->speed, out.acceleration = judge_->acceleration;
  out.jerk = judge_->jerk, out.range = judge_->range;
  out.limited = session_.report().limited;
  return out;
}

void Track::cycle() {
  now_ = now_ + from_seconds(scene_.controller.cycle_ms * 1e-3);
  controller_.step(now_);
  const auto datagram = controller_.egm_datagram();
  if (!datagram) return;
  std::array<std::byte, 512> reply{};
  const std::size_t n = session_.on_datagram(*datagram, now_ + 200 * kMicrosecond, reply);
  if (n == 0) return;
  controller_.on_egm_datagram(std::span(reply).first(n));
  abb::egm::EgmSensor sensor;
  if (!sensor.ParseFromArray(reply.data(), static_cast<int>(n))) return;
  std::array<double, 6> q{};
  Joints radians{};
  for (int i = 0; i < 6; ++i) {
    q[static_cast<std::size_t>(i)] = sensor.planned().joints().joints(i);
    radians[static_cast<std::size_t>(i)] = rad(q[static_cast<std::size_t>(i)]);
  }
  if (judge_) judge_->see(q, scene_.controller.cycle_ms * 1e-3);
  const Eigen::Vector3d at = foot(cell_, radians, top_);
  reference_way_ += (at - last_foot_).norm();
  last_foot_ = at;
}

/// Distance from the planned way near plan time t: the arm is up to 0.4 s late.
double Track::off_way(const Eigen::Vector3d& p, double t, const plan::MotionPlan& plan) const {
  const auto at = [&](double s) {
    return static_cast<std::size_t>(std::clamp(s / plan.period_s, 0.0, static_cast<double>(way_.size() - 2)));
  };
  double nearest = 1e9;
  for (std::size_t k = at(t - 0.4); k <= at(t + 0.02); ++k) {
    const Eigen::Vector3d d = way_[k + 1] - way_[k];
    const double u = d.squaredNorm() > 0 ? std::clamp((p - way_[k]).dot(d) / d.squaredNorm(), 0.0, 1.0) : 0;
    nearest = std::min(nearest, (way_[k] + u * d - p).norm());
  }
  return nearest;
}

}  // namespace weldcell::bench
