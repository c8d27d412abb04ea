// Drives a cell input by input and remembers what came out.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>

#include "egm.pb.h"
#include "weldcell/job/cell.hpp"

namespace weldcell::job {

inline workpiece::Workpiece part() {
  workpiece::Workpiece w;
  w.name = "bar";
  w.height_mm = 40;
  w.members.push_back({"bar", "1", {{0, 0}, {400, 0}, {400, 40}, {0, 40}}, 0});
  workpiece::Weld weld;
  weld.name = "w1";
  weld.pieces.push_back({});
  w.welds = {weld, weld};
  return w;
}

inline std::shared_ptr<const Prepared> prepared() {
  auto p = std::make_shared<Prepared>();
  p->steps.resize(2);
  p->step_poses.resize(2);
  auto scan = std::make_shared<plan::MotionPlan>();
  scan->id = 7;
  scan->samples.resize(3);
  p->scan = scan;
  return p;
}

/// Drives a cell and remembers what came out.
class Driver {
 public:
  explicit Driver(bool plc_required = false) : cell(setup(), wire::LaserFormat{}, plc_required) {}

  static cell::CellSetup setup() {
    cell::CellSetup s;
    s.arm.c2 = 900;
    return s;
  }

  Driver& feed(InputBody body, double after_s = 0.01) {
    now = now + from_seconds(after_s);
    last = cell.step({now, std::move(body)});
    all.insert(all.end(), last.begin(), last.end());
    return *this;
  }
  Driver& order(wire::PlcCommand c) { return feed(OperatorCommand{c, "test"}); }

  template <typename T>
  std::vector<T> of(const Outputs& outputs) const {
    std::vector<T> found;
    for (const Output& o : outputs) {
      if (const T* t = std::get_if<T>(&o)) found.push_back(*t);
    }
    return found;
  }

  Driver& ready(bool guidance) {
    JobArrived arrived;
    arrived.id = arrived.order.name = "job";
    arrived.order.guidance = guidance;
    feed(LinkChange{Link::Laser, true, ""}).feed(LinkChange{Link::Rws, true, ""});
    feed(arrived).feed(ImportDone{part()}).feed(PlanDone{prepared()});
    return *this;
  }

  Driver& robot_done() {
    const auto requests = of<RobotRequest>(all);
    const auto it = std::find_if(requests.rbegin(), requests.rend(),
                                 [](const auto& r) { return r.task != RobotTask::Stop; });
    RobotReply reply;
    reply.id = it->id;
    reply.ok = true;
    return feed(reply);
  }

  State state() const { return cell.status().state; }

  Cell cell;
  HostTime now;
  Outputs last, all;
};

/// A frame of the controller with everything on and its correction in the given state.
inline std::vector<std::byte> egm_datagram(abb::egm::EgmMCIState::MCIStateType mci) {
  abb::egm::EgmRobot robot;
  robot.mutable_header()->set_seqno(1);
  robot.mutable_header()->set_tm(1);
  robot.mutable_header()->set_mtype(abb::egm::EgmHeader::MSGTYPE_DATA);
  for (int i = 0; i < 6; ++i) {
    robot.mutable_feedback()->mutable_joints()->add_joints(0);
    robot.mutable_planned()->mutable_joints()->add_joints(0);
  }
  robot.mutable_motorstate()->set_state(abb::egm::EgmMotorState::MOTORS_ON);
  robot.mutable_mcistate()->set_state(mci);
  robot.mutable_rapidexecstate()->set_state(abb::egm::EgmRapidCtrlExecState::RAPID_RUNNING);
  std::vector<std::byte> out(robot.ByteSizeLong());
  robot.SerializeToArray(out.data(), static_cast<int>(out.size()));
  return out;
}

using Mci = abb::egm::EgmMCIState;

inline EgmCycle frame(Mci::MCIStateType mci, bool plan_done = false) {
  EgmCycle cycle;
  cycle.datagram = egm_datagram(mci);
  cycle.report.plan_id = 7;
  cycle.report.phase = robot::EgmPhase::Following;
  cycle.report.plan_done = plan_done;
  return cycle;
}

/// A ready cell to Scanning.
inline Driver& scan(Driver& d) {
  d.ready(false).order(wire::PlcCommand::Arm).order(wire::PlcCommand::Start).robot_done();
  for (int i = 0; i < 6; ++i) d.feed(frame(Mci::MCI_RUNNING));
  return d;
}

/// A ready cell to Welding with its program started: two seams, none begun.
inline Driver& weld(Driver& d) {
  scan(d).feed(frame(Mci::MCI_RUNNING, true)).feed(LaserBytes{}).feed(Tick{}, 0.2);
  auto solution = std::make_shared<Solution>();
  solution->verdict.verdict = localize::Verdict::Weld;
  solution->rapid = "MODULE WeldcellJob";
  return d.feed(SolveDone{solution}).robot_done().robot_done();
}

inline bool moves(const Outputs& outputs) {
  for (const Output& o : outputs) {
    if (std::holds_alternative<StartMotion>(o)) return true;
    const auto* r = std::get_if<RobotRequest>(&o);
    if (r != nullptr && r->task != RobotTask::Stop && r->task != RobotTask::Query) return true;
  }
  return false;
}

}  // namespace weldcell::job
