// The controller's side of EGM joint guidance: channel states, the control law, time-out and convergence, and
// the EgmRobot frame. Pure.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "weldcell/kinematics/arm_model.hpp"

namespace abb::egm {
class EgmSensor;
}

namespace weldcell::sim {

enum class EgmState { Disconnected, Connected, Running };
enum class MciReport { Undefined = 0, Error = 1, Stopped = 2, Running = 3 };

/// What a frame of EGMActPose is relative to, by RAPID's numbers.
enum class EgmFrameType { Base = 0, Tool = 1, Wobj = 2, World = 3, Joint = 4 };

/// Arguments of EGMActJoint or EGMActPose, with the controller's defaults.
struct EgmActivation {
  double low_pass_hz = 20;
  double max_speed_deviation_rad_s = 0.017453292519943295;  ///< 1 deg/s, the well-known trap
  double max_position_deviation_rad = 17.453292519943297;
  std::array<double, 6> min_rad{}, max_rad{};  ///< convergence bands
  bool pose = false;                           ///< poses of the tool in `sensor` are followed, not joints
  Eigen::Isometry3d sensor = Eigen::Isometry3d::Identity();  ///< in Base
  std::array<double, 6> pose_min{}, pose_max{};              ///< mm, then deg about x, y, z
  bool stream = false;                                       ///< sends before and after the run, too
  int sample_cycles = 1;
  Eigen::Isometry3d tool = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d wobj = Eigen::Isometry3d::Identity();
};

/// Arguments of EGMRunJoint.
struct EgmRun {
  std::array<bool, 6> axes{};
  double cond_time_s = 1;
  double ramp_in_s = 0;
  double ramp_out_s = 0.5;
  double position_gain_share = 1;
};

/// What a frame says beyond the channel's own state.
struct EgmFrame {
  std::uint32_t tm_ms = 0;
  std::int64_t feedback_us = 0, planned_us = 0;
  kinematics::Joints measured{}, planned{};
  bool motors_on = false, rapid_running = false;
  bool rapid_unknown = false;  ///< UNDEFINED is told instead
};

/// What a RobotWare puts into its frames.
struct EgmShape {
  int robotware = 610;  ///< 607, 610, 700, 706, 716
  int external_axes = 0;
  bool seqno_restarts = true;
};

class EgmChannel {
 public:
  enum class Outcome { None, Converged, TimedOut, OutOfRange };

  EgmChannel(const kinematics::ArmModel& arm, double position_gain, double low_pass_hz, double cycle_s,
             EgmShape shape = {});

  /// Joint ranges and speeds from now on.
  void set_arm(const kinematics::ArmModel& arm) { arm_ = arm; }
  void reset();
  void get_id();
  void set_up(double comm_timeout_s);
  bool activate(const EgmActivation& activation);             ///< false in the wrong state
  bool run(const EgmRun& run, const kinematics::Joints& at);  ///< false in the wrong state
  /// Ends guidance without an error (EGMStop, program stop).
  void end();
  /// Guidance goes on from the posture now, after the program was stopped while it ran.
  void resume(const kinematics::Joints& at) {
    reference_ = at;
    speed_reference_ = {};
    age_s_ = 0;
  }

  EgmState state() const { return state_; }
  bool guiding() const { return state_ == EgmState::Running && mci_ == MciReport::Running; }
  bool sending() const { return sending_; }
  double default_low_pass_hz() const { return low_pass_hz_; }

  void on_datagram(std::span<const std::byte> datagram);
  std::uint64_t malformed() const { return malformed_; }
  /// Text for the event log of malformed datagrams since the last call; empty when there were none.
  std::string take_complaint();

  /// One cycle of guidance: moves `position` and `speed` (the servo's reference).
  Outcome step(kinematics::Joints& position, kinematics::Joints& speed);
  /// The frame due in this cycle.
  std::vector<std::byte> frame(const EgmFrame& now);
  bool frame_due();

 private:
  bool read(std::span<const std::byte> datagram);
  bool refuse(const char* why);
  bool take_joints(const abb::egm::EgmSensor& message);
  bool take_pose(const abb::egm::EgmSensor& message);
  void control(kinematics::Joints& position, kinematics::Joints& speed);
  bool converged(const kinematics::Joints& position) const;
  bool pose_converged(const kinematics::Joints& position) const;

  kinematics::ArmModel arm_;
  double gain_, low_pass_hz_, cycle_s_;
  EgmShape shape_;
  EgmState state_ = EgmState::Disconnected;
  MciReport mci_ = MciReport::Undefined;
  EgmActivation activation_;
  EgmRun run_;
  bool activated_ = false, sending_ = false;
  double comm_timeout_s_ = 1, age_s_ = 0, running_s_ = 0, converged_s_ = 0;
  bool convergence_met_ = false, position_given_ = true, out_of_range_ = false;
  double utilization_ = 0;
  std::uint32_t seqno_ = 0, moves_ = 0;
  int cycle_count_ = 0;
  Eigen::Isometry3d pose_target_ = Eigen::Isometry3d::Identity();  ///< of the tool, in Base
  kinematics::Joints start_{}, reference_{}, speed_reference_{}, filtered_{};
  std::deque<std::vector<std::byte>> queue_;
  std::uint64_t malformed_ = 0, complained_ = 0;
  std::string complaint_;
};

}  // namespace weldcell::sim
