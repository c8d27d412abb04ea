// One ride of the simulated arm along a plan, by the shipped RAPID module and the daemon's own session.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "weldcell/app/robot_runner.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/files/cell_file.hpp"
#include "weldcell/plan/motion_plan.hpp"
#include "weldcell/robot/egm_session.hpp"
#include "weldcell/sim/controller.hpp"

namespace weldcell::bench {

/// Differences of the references as they were sent, as shares of the cell's limits.
class Judge {
 public:
  explicit Judge(const cell::CellSetup& cell) : cell_(cell) {}
  void see(const std::array<double, 6>& reference_deg, double dt_s) {
    ++seen_;
    for (std::size_t i = 0; i < 6; ++i) {
      const double q = rad(reference_deg[i]);
      const double v = seen_ > 1 ? (q - q_[i]) / dt_s : 0;
      const double a = seen_ > 2 ? (v - v_[i]) / dt_s : 0;
      const double j = seen_ > 3 ? (a - a_[i]) / dt_s : 0;
      speed = std::max(speed, std::abs(v) / (cell_.arm.max_speed[i] * cell_.limits.joint_speed_fraction));
      acceleration = std::max(acceleration, std::abs(a) / cell_.limits.joint_acceleration[i]);
      jerk = std::max(jerk, std::abs(j) / cell_.limits.joint_jerk[i]);
      const double middle = (cell_.arm.upper[i] + cell_.arm.lower[i]) / 2;
      const double half = (cell_.arm.upper[i] - cell_.arm.lower[i]) / 2 - cell_.limits.limit_margin_rad;
      range = std::max(range, std::abs(q - middle) / half);
      q_[i] = q, v_[i] = v, a_[i] = a;
    }
  }
  double speed = 0, acceleration = 0, jerk = 0, range = 0;

 private:
  const cell::CellSetup& cell_;
  int seen_ = 0;
  kinematics::Joints q_{}, v_{}, a_{};
};

struct Law {
  double gain = 20, low_pass_hz = 100, cycle_ms = 4.0;
};

struct Ride {
  bool finished = false;
  double contour_mm = 0;         ///< worst distance of the beam's foot from its planned way, in the passes
  double stop_reference_mm = 0;  ///< way of the beam's foot from the stop's frame to rest, as commanded
  double stop_arm_mm = 0;        ///< the same as the arm did it
  double stop_off_path_mm = 0;   ///< and how far from the planned way that led
  double speed = 0, acceleration = 0, jerk = 0, range = 0;  ///< shares of the limits
  std::uint32_t limited = 0;
};

class DirectTransport final : public ports::HttpTransport {
 public:
  explicit DirectTransport(sim::Controller& controller) : controller_(&controller) {}
  Result<ports::HttpReply> exchange(const ports::HttpRequest& request) override {
    return controller_->handle_rws(request);
  }

 private:
  sim::Controller* controller_;
};

/// The simulated controller runs the shipped module; the daemon's session streams the plan to it.
class Track {
 public:
  Track(const files::CellConfig& config, const Law& law, double top_z_mm);

  /// Follows the plan; with stop_s >= 0 a stop is asked for at that time of the plan.
  Ride follow(const plan::MotionPlan& plan, double stop_s = -1);

 private:
  void open(const plan::MotionPlan& plan);
  void cycle();
  double off_way(const Eigen::Vector3d& p, double t, const plan::MotionPlan& plan) const;

  cell::CellSetup cell_;
  double top_;
  sim::Scene scene_;
  sim::Controller controller_;
  DirectTransport transport_;
  adapters::RwsClient rws_;
  app::RobotRunner runner_;
  robot::EgmSession session_;
  std::unique_ptr<Judge> judge_;
  std::vector<Eigen::Vector3d> way_;
  Eigen::Vector3d last_foot_ = Eigen::Vector3d::Zero();
  double reference_way_ = 0;
  HostTime now_;
};

}  // namespace weldcell::bench
