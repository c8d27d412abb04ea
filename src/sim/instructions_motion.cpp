// Motion and arc welding, and how instructions read their arguments.
#include <cmath>

#include "sim/instruction.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::sim {

using rapid::Call;
using rapid::RapidError;
using rapid::Value;

namespace {

constexpr double kQuaternionTolerance = 1e-5;
constexpr std::size_t kMovesAhead = 2;  // fly-by moves that the program runs ahead of the arm

RapidError motion_fault(const Error& error) {
  if (error.code == "motion.reach") return {rapid::kErrNotHandled, error.text(), 50050};
  if (error.code == "motion.configuration") return {rapid::kErrNotHandled, error.text(), 50080};
  if (error.code == "motion.singular") return {rapid::kErrNotHandled, error.text(), 50026};
  return {rapid::kErrNotHandled, error.text(), 40199};
}

}  // namespace

double number(const Value& value, std::size_t i) { return value.items.at(i).number; }

Eigen::Isometry3d pose_of(const Value& trans, const Value& rot, const std::string& what) {
  const Eigen::Quaterniond q(number(rot, 0), number(rot, 1), number(rot, 2), number(rot, 3));
  if (std::abs(q.norm() - 1) > kQuaternionTolerance) {
    throw RapidError{rapid::kErrNotHandled, what + ": orientation is not normalized", 40199};
  }
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.linear() = q.normalized().toRotationMatrix();
  out.translation() = Eigen::Vector3d(number(trans, 0), number(trans, 1), number(trans, 2));
  return out;
}

const Value& shaped(const Call& call, std::size_t i, std::size_t components, const char* type) {
  const Value& value = call.at(i).value;
  if (value.items.size() != components) {
    throw RapidError{rapid::kErrArgument,
                     call.name + ": argument " + std::to_string(i + 1) + " is not a " + type, 40160};
  }
  return value;
}

Eigen::Isometry3d tool_of(const Value& tool, const std::string& what) {
  if (tool.items.size() != 3) throw RapidError{rapid::kErrArgument, what + ": not a tooldata", 40160};
  if (!tool.items[0].flag)
    throw RapidError{rapid::kErrNotHandled, what + ": stationary tools are not supported", 40199};
  if (number(tool.items[2], 0) <= 0)
    throw RapidError{rapid::kErrNotHandled, what + ": tool load has no mass", 41438};
  return pose_of(tool.items[1].items[0], tool.items[1].items[1], what);
}

Eigen::Isometry3d wobj_of(const Value& wobj, const std::string& what) {
  if (wobj.items.size() != 5) throw RapidError{rapid::kErrArgument, what + ": not a wobjdata", 40160};
  if (wobj.items[0].flag || !wobj.items[1].flag) {
    throw RapidError{rapid::kErrNotHandled, what + ": moving work objects are not supported", 40199};
  }
  return pose_of(wobj.items[3].items[0], wobj.items[3].items[1], what) *
         pose_of(wobj.items[4].items[0], wobj.items[4].items[1], what);
}

Eigen::Isometry3d wobj_option(const Call& call) {
  const auto* wobj = call.option("wobj");
  return wobj ? wobj_of(wobj->value, call.name) : Eigen::Isometry3d::Identity();
}

bool switched(const Call& call, const char* on) { return call.option(on) != nullptr; }

double option_number(const Call& call, const char* name, double otherwise) {
  const auto* option = call.option(name);
  return option && option->has_value ? option->value.number : otherwise;
}

Move Instruction::base_move(std::size_t speed, std::size_t zone, std::size_t tool) {
  Move out;
  const Value& v = shaped(call_, speed, 4, "speeddata");
  const Value& z = shaped(call_, zone, 7, "zonedata");
  out.speed_mm_s = option_number(call_, "v", number(v, 0));
  out.turn_rad_s = rad(std::max(number(v, 1), 0.1));
  if (out.speed_mm_s <= 0)
    throw RapidError{rapid::kErrNotHandled, call_.name + ": speed must be above 0", 40199};
  out.fine = z.items[0].flag;
  out.tool = tool_of(call_.at(tool).value, call_.name);
  return out;
}

Eigen::Isometry3d Instruction::target(std::size_t i) {
  const Value& p = shaped(call_, i, 4, "robtarget");
  return wobj_option(call_) *
         pose_of(p.items[0], p.items[1], call_.at(i).name.empty() ? call_.name : call_.at(i).name);
}

kinematics::Configuration Instruction::configuration(std::size_t i) {
  const Value& c = call_.at(i).value.items.at(2);
  return {static_cast<int>(number(c, 0)), static_cast<int>(number(c, 1)), static_cast<int>(number(c, 2)),
          static_cast<int>(number(c, 3))};
}

void Instruction::start(const Move& move) {
  ControllerState& s = s_;
  if (s.drive != Drive::Path)
    throw RapidError{rapid::kErrNotHandled, "motion while EGM guides the arm", 41826};
  if (std::exchange(s.singular_ahead, false)) {
    throw RapidError{rapid::kErrNotHandled, call_.at(0).name + ": too close to the wrist's singularity",
                     50026};
  }
  if (Status added = s.path.add(move); !added) throw motion_fault(added.error());
  if (move.fine) {
    waits_.push_back([&s] { return s.path.idle(); });
  } else {
    waits_.push_back([&s] { return s.path.queued() <= kMovesAhead; });
  }
}

void Instruction::move_abs_j() {
  Move move = base_move(1, 2, 3);
  const Value& j = shaped(call_, 0, 2, "jointtarget");
  for (std::size_t i = 0; i < 6; ++i) move.joints[i] = rad(number(j.items[0], i));
  start(move);
}

void Instruction::move_j() {
  Move move = base_move(1, 2, 3);
  const Eigen::Isometry3d flange = target(0) * move.tool.inverse();
  const auto solutions = kinematics::inverse(s_.arm, {flange}, s_.path.end());
  if (solutions.empty())
    throw RapidError{rapid::kErrNotHandled, call_.at(0).name + ": position outside reach", 50050};
  const kinematics::Joints* chosen = nullptr;
  for (const auto& solution : solutions) {
    if (chosen) break;
    if (!s_.configuration_joint || kinematics::configuration(s_.arm, solution) == configuration(0))
      chosen = &solution;
  }
  if (!chosen) {
    throw RapidError{rapid::kErrNotHandled,
                     call_.at(0).name + ": not reached in the programmed configuration", 50080};
  }
  move.joints = *chosen;
  start(move);
}

Move Instruction::path_move(std::size_t to, std::size_t speed, std::size_t zone, std::size_t tool) {
  Move move = base_move(speed, zone, tool);
  move.kind = Move::Kind::Line;
  move.target = target(to);
  move.check_configuration = s_.configuration_line;
  move.configuration = configuration(to);
  return move;
}

void Instruction::move_l() { start(path_move(0, 1, 2, 3)); }

void Instruction::move_c() {
  Move move = path_move(1, 2, 3, 4);
  move.kind = Move::Kind::Circle;
  move.via = target(0);
  start(move);
}

void Instruction::wait_rob() {
  ControllerState& s = s_;
  waits_.push_back([&s] { return s.path.idle(); });
}

void Instruction::wait_seconds(double duration_s) {
  ControllerState& s = s_;
  if (duration_s <= 0) return;
  // Counted from when the wait is reached, not from when it was queued.
  waits_.push_back([&s, duration_s, end = -1.0]() mutable {
    if (end < 0) end = s.run_time_s + duration_s;
    return s.run_time_s >= end - 1e-9;
  });
}

const Value& Instruction::seam(std::size_t i) { return shaped(call_, i, 16, "seamdata"); }

double Instruction::weld_speed(std::size_t i) {
  const double speed = number(shaped(call_, i, 4, "welddata"), 0);
  if (speed <= 0)
    throw RapidError{rapid::kErrNotHandled, call_.name + ": weld_speed must be above 0", 110001};
  return speed;
}

void Instruction::arc_l_start() {
  Move move = path_move(0, 1, 4, 5);
  move.fine = true;
  ControllerState& s = s_;
  const Value& data = seam(2);
  weld_speed(3);
  std::string name = call_.routine;
  if (const auto* given = call_.option("seamname"); given && !given->value.text.empty())
    name = given->value.text;
  start(move);
  wait_seconds(number(data, 0) + number(data, 1));
  waits_.push_back([&s, name, tool = move.tool] {
    s.arc_on = true;
    s.arc_tool = tool;
    s.welds.push_back({name, {}});
    if (auto* signal = s.memory.symbol("", "doarcon")) signal->value.number = 1;
    return true;
  });
  wait_seconds(number(data, 3));
}

void Instruction::arc_move(Move move, std::size_t seam_at) {
  if (!s_.arc_on) throw RapidError{rapid::kErrNotHandled, call_.name + " without ArcLStart", 110002};
  move.speed_mm_s = weld_speed(seam_at + 1);
  (void)seam(seam_at);
  start(move);
}

void Instruction::arc_off(std::size_t seam_at) {
  ControllerState& s = s_;
  const Value& data = seam(seam_at);
  wait_seconds(number(data, 9) + number(data, 10));
  waits_.push_back([&s] {
    s.arc_on = false;
    if (auto* signal = s.memory.symbol("", "doarcon")) signal->value.number = 0;
    return true;
  });
  wait_seconds(number(data, 15));
}

void Instruction::arc_l() { arc_move(path_move(0, 1, 4, 5), 2); }

void Instruction::arc_l_end() {
  Move move = path_move(0, 1, 4, 5);
  move.fine = true;
  arc_move(move, 2);
  arc_off(2);
}

Move Instruction::circle() {
  Move move = path_move(1, 2, 5, 6);
  move.kind = Move::Kind::Circle;
  move.via = target(0);
  return move;
}

void Instruction::arc_c() { arc_move(circle(), 3); }

void Instruction::arc_c_end() {
  Move move = circle();
  move.fine = true;
  arc_move(move, 3);
  arc_off(3);
}

}  // namespace weldcell::sim
