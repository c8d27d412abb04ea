// Programmed motion: a queue of joint, line and circle moves run at one speed profile, smoothed so that the
// arm starts, turns and stops like a machine with mass. Pure.
#pragma once

#include <array>
#include <deque>
#include <vector>

#include "weldcell/base/result.hpp"
#include "weldcell/kinematics/arm_model.hpp"

namespace weldcell::sim {

struct Move {
  enum class Kind { Joint, Line, Circle };
  Kind kind = Kind::Joint;
  kinematics::Joints joints{};                               ///< target of a joint move
  Eigen::Isometry3d target = Eigen::Isometry3d::Identity();  ///< TCP in Base at the end of a line or circle
  Eigen::Isometry3d via = Eigen::Isometry3d::Identity();     ///< TCP on the circle
  Eigen::Isometry3d tool = Eigen::Isometry3d::Identity();    ///< TCP in Flange
  double speed_mm_s = 100;
  double turn_rad_s = 8.7;
  bool fine = true;  ///< stop exactly there; false: pass through
  bool check_configuration = false;
  kinematics::Configuration configuration;  ///< wanted at the end when checked
};

class PathMotion {
 public:
  PathMotion(const kinematics::ArmModel& arm, double cycle_s);

  /// Appends a move that starts where the last one ends. Errors: "motion.reach" (outside reach or a joint
  /// limit), "motion.configuration" (ends in another configuration), "motion.singular" (a joint would have to
  /// jump).
  Status add(const Move& move);
  /// Joint ranges and speeds for the moves to come.
  void set_arm(const kinematics::ArmModel& arm) { arm_ = arm; }
  /// Forgets all moves; the reference stands still at `joints`.
  void reset(const kinematics::Joints& joints);
  /// One cycle. speed_ratio 0..1 of the programmed speed; hold ramps to rest on the path.
  void step(double speed_ratio, bool hold);

  const kinematics::Joints& reference() const { return smooth_; }
  /// No move left and the reference at rest.
  bool idle() const { return moves_.empty() && settle_ == 0; }
  bool at_rest() const { return rate_ == 0 && still_ >= kWindow; }
  std::size_t queued() const { return moves_.size(); }
  /// Posture at the end of the last move added.
  const kinematics::Joints& end() const { return end_; }

 private:
  struct Segment {
    Move move;
    kinematics::Joints from{}, to{};
    Eigen::Isometry3d start = Eigen::Isometry3d::Identity();
    Eigen::Vector3d center = Eigen::Vector3d::Zero(), axis = Eigen::Vector3d::UnitZ();
    double sweep_rad = 0;
    double duration_s = 0;                           ///< at programmed speed
    double acceleration = 0;                         ///< of the speed ratio, 1/s
    kinematics::Joints tangent_in{}, tangent_out{};  ///< rad/s at programmed speed
  };

  /// Cycles over which the reference is averaged: 48 ms at 4 ms.
  static constexpr int kWindow = 12;

  Eigen::Isometry3d pose(const Segment& segment, double fraction) const;
  Status prepare_joint(Segment& segment) const;
  Status prepare_path(Segment& segment) const;
  Status prepare_circle(Segment& segment) const;
  Status walk(Segment& segment) const;
  void finish_limits(Segment& segment, const kinematics::Joints& fastest) const;
  double corner_ratio(const Segment& a, const Segment& b) const;
  double end_ratio() const;
  void smooth();

  kinematics::ArmModel arm_;
  double cycle_s_;
  kinematics::Joints acceleration_{};
  std::deque<Segment> moves_;
  double u_s_ = 0, rate_ = 0;
  int settle_ = 0, still_ = kWindow;
  kinematics::Joints raw_{}, smooth_{}, end_{};
  std::array<kinematics::Joints, kWindow> window_{};
  std::size_t window_at_ = 0;
};

}  // namespace weldcell::sim
