// What the cell does when something is lost or stopped, input by input.
#include "driver.hpp"

namespace weldcell::job {
namespace {

TEST(CellRecovery, SeamsAskedForAtAResumeAreKnownThoughPlanningIsFaster) {
  Driver d;
  d.feed(LinkChange{Link::Laser, true, ""}).feed(LinkChange{Link::Rws, true, ""});
  JobArrived arrived;
  arrived.id = arrived.order.name = "job";
  arrived.interrupted = arrived.guidance_done = arrived.weld_begun = true;
  d.feed(arrived).order(wire::PlcCommand::Arm).order(wire::PlcCommand::Resume);
  const RobotRequest query = d.of<RobotRequest>(d.last).back();
  ASSERT_EQ(query.task, RobotTask::Query);
  d.feed(ImportDone{part()}).feed(PlanDone{prepared()});
  ASSERT_EQ(d.state(), State::PreparingScan) << "the scan was asked for before the query was answered";
  RobotReply reply;
  reply.id = query.id;
  reply.ok = true;
  reply.seams_done = 1;
  d.feed(reply);
  EXPECT_EQ(d.cell.status().seams_done, 1);
  d.order(wire::PlcCommand::Stop).order(wire::PlcCommand::Arm).order(wire::PlcCommand::Resume);
  reply.id = d.of<RobotRequest>(d.last).back().id;
  reply.ok = false;
  reply.text = "no answer";
  d.feed(reply);
  EXPECT_EQ(d.state(), State::Faulted) << "nobody knows which seams are welded";
  EXPECT_EQ(d.cell.status().fault, FaultCode::RobotCommand);
}

using Mci = abb::egm::EgmMCIState;

EgmCycle frame(Mci::MCIStateType mci) {
  EgmCycle cycle;
  cycle.datagram = egm_datagram(mci);
  cycle.report.plan_id = 7;
  cycle.report.phase = robot::EgmPhase::Following;
  return cycle;
}

Driver& scan(Driver& d) {
  d.ready(false).order(wire::PlcCommand::Arm).order(wire::PlcCommand::Start).robot_done();
  for (int i = 0; i < 6; ++i) d.feed(frame(Mci::MCI_RUNNING));
  return d;
}

TEST(CellRecovery, AControllerThatLeavesEgmIsAStoppedRobot) {
  Driver d;
  ASSERT_EQ(scan(d).state(), State::Scanning);
  d.feed(frame(Mci::MCI_STOPPED));
  EXPECT_EQ(d.state(), State::Faulted);
  EXPECT_EQ(d.cell.status().fault, FaultCode::RobotStopped);
  EXPECT_FALSE(d.cell.status().armed);
}

TEST(CellRecovery, AScanWithoutFramesIsALostLinkAndTellsTheControllersLog) {
  Driver d;
  ASSERT_EQ(scan(d).state(), State::Scanning);
  d.feed(LaserBytes{}, 0.3).feed(Tick{}, 0.2);
  EXPECT_EQ(d.state(), State::Faulted);
  EXPECT_EQ(d.cell.status().fault, FaultCode::EgmLost);
  RobotReply stopped;
  stopped.id = d.of<RobotRequest>(d.last).back().id;
  stopped.ok = true;
  stopped.text = "10013 Emergency stop state";
  d.feed(stopped);
  EXPECT_NE(d.cell.status().fault_text.find("10013 Emergency stop"), std::string::npos);
  EXPECT_EQ(d.state(), State::Faulted);
}

TEST(CellRecovery, ALostPlcStopsWhatMovesAndNothingElse) {
  Driver waits(true);
  waits.feed(LinkChange{Link::Plc, true, ""}).ready(false).feed(LinkChange{Link::Plc, false, "still"});
  EXPECT_EQ(waits.state(), State::Ready);
  Driver d(true);
  d.feed(LinkChange{Link::Plc, true, ""});
  ASSERT_EQ(scan(d).state(), State::Scanning);
  d.feed(LinkChange{Link::Plc, false, "the heartbeat stands still"});
  EXPECT_EQ(d.state(), State::Faulted);
  EXPECT_EQ(d.cell.status().fault, FaultCode::PlcLost);
  EXPECT_EQ(d.of<StopMotion>(d.last).size(), 1U);
  EXPECT_EQ(d.of<RobotRequest>(d.last).back().task, RobotTask::Stop);
  d.order(wire::PlcCommand::Arm).order(wire::PlcCommand::Resume);
  EXPECT_EQ(d.state(), State::Faulted) << "the PLC is still missing";
}

TEST(CellRecovery, AStopThatDidNotArriveIsSentAgainWhenTheControllerAnswers) {
  Driver d;
  ASSERT_EQ(scan(d).state(), State::Scanning);
  d.order(wire::PlcCommand::Stop);
  RobotReply lost;
  lost.id = d.of<RobotRequest>(d.last).back().id;
  lost.text = "the connection was refused";
  d.feed(lost).feed(LinkChange{Link::Rws, false, "refused"}).feed(Tick{}, 5);
  EXPECT_TRUE(d.of<RobotRequest>(d.last).empty()) << "nobody is there";
  d.feed(LinkChange{Link::Rws, true, ""}).feed(Tick{}, 1);
  ASSERT_EQ(d.of<RobotRequest>(d.last).size(), 1U);
  EXPECT_EQ(d.of<RobotRequest>(d.last)[0].task, RobotTask::Stop);
  RobotReply done;
  done.id = d.of<RobotRequest>(d.last)[0].id;
  done.ok = true;
  d.feed(done).feed(Tick{}, 5);
  EXPECT_TRUE(d.of<RobotRequest>(d.last).empty());
  EXPECT_EQ(d.state(), State::Faulted);
}

TEST(CellRecovery, AJobFoundInterruptedStopsWhatOfItMayStillRunAndSparesOtherPrograms) {
  Driver d;
  JobArrived arrived;
  arrived.id = arrived.order.name = "job";
  arrived.interrupted = arrived.guidance_done = arrived.weld_begun = true;
  d.feed(arrived, 10).feed(Tick{}, 5);
  EXPECT_NE(d.cell.status().fault_text.find("RAPID may still be welding"), std::string::npos);
  EXPECT_TRUE(d.of<RobotRequest>(d.all).empty()) << "nobody is there";
  d.feed(LinkChange{Link::Rws, true, ""}).feed(Tick{}, 1);
  ASSERT_EQ(d.of<RobotRequest>(d.last).size(), 1U);
  EXPECT_EQ(d.of<RobotRequest>(d.last)[0].task, RobotTask::Stop);
  EXPECT_TRUE(d.of<RobotRequest>(d.last)[0].own_only);
  RobotReply stopped;
  stopped.id = d.of<RobotRequest>(d.last)[0].id;
  stopped.ok = stopped.running = true;
  d.feed(stopped);
  EXPECT_TRUE(d.cell.status().fault_text.empty());
  EXPECT_EQ(d.state(), State::Interrupted);
  EXPECT_FALSE(moves(d.all));
}

}  // namespace
}  // namespace weldcell::job
