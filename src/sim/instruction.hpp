// One RAPID instruction of the simulated controller. Private; the definitions lie with their subjects:
// instructions.cpp (waiting, signals, numbers, words), instructions_motion.cpp (motion, arc welding),
// instructions_egm.cpp.
#pragma once

#include <string>

#include "sim/controller_state.hpp"

namespace weldcell::sim {

// ---- arguments; throw rapid::RapidError with the instruction's name when they have another shape ----
double number(const rapid::Value& value, std::size_t i);
Eigen::Isometry3d pose_of(const rapid::Value& trans, const rapid::Value& rot, const std::string& what);
const rapid::Value& shaped(const rapid::Call& call, std::size_t i, std::size_t components, const char* type);
Eigen::Isometry3d tool_of(const rapid::Value& tool, const std::string& what);
Eigen::Isometry3d wobj_of(const rapid::Value& wobj, const std::string& what);
Eigen::Isometry3d wobj_option(const rapid::Call& call);
bool switched(const rapid::Call& call, const char* on);
double option_number(const rapid::Call& call, const char* name, double otherwise);

/// Runs the instructions of one call against the controller's state.
class Instruction {
 public:
  using Waits = std::deque<rapid::Machine::Wait>;
  Instruction(ControllerState& s, const rapid::Call& call, Waits& waits)
      : s_(s), call_(call), waits_(waits) {}

  /// False when the instruction is unknown.
  bool run();

 private:
  // ---- motion ----
  Move base_move(std::size_t speed, std::size_t zone, std::size_t tool);
  Eigen::Isometry3d target(std::size_t i);
  kinematics::Configuration configuration(std::size_t i);
  void start(const Move& move);
  void move_abs_j();
  void move_j();
  Move path_move(std::size_t to, std::size_t speed, std::size_t zone, std::size_t tool);
  void move_l();
  void move_c();
  void wait_rob();

  // ---- arc welding ----
  void wait_seconds(double duration_s);
  const rapid::Value& seam(std::size_t i);
  double weld_speed(std::size_t i);
  void arc_l_start();
  void arc_move(Move move, std::size_t seam_at);
  void arc_off(std::size_t seam_at);
  void arc_l();
  void arc_l_end();
  Move circle();
  void arc_c();
  void arc_c_end();

  // ---- waiting, signals, numbers, words ----
  void wait_time();
  void wait_signal();
  void set_signal();
  void step_number();
  void write();
  void conf();
  void sing_area();
  void nothing() {}

  // ---- EGM ----
  [[noreturn]] void state_fault();
  void egm_reset();
  void egm_get_id();
  void egm_setup();
  void egm_act();
  void egm_run();
  void egm_wait();
  void egm_stop();
  void common_activation(EgmActivation& a, const char* name);
  Eigen::Isometry3d frame_of(std::size_t frame, std::size_t type);
  void egm_act_pose();
  void egm_run_pose();
  void begin_guidance(const EgmRun& run);

  ControllerState& s_;
  const rapid::Call& call_;
  Waits& waits_;
};

}  // namespace weldcell::sim
