// What the cell does when something is lost or stopped, input by input.
#include "driver.hpp"

namespace weldcell::job {
namespace {

TEST(CellRecovery, AScanIsNotOverBecauseTheLastOneWas) {
  Driver d;
  d.ready(false).order(wire::PlcCommand::Arm).order(wire::PlcCommand::Start).robot_done();
  for (int i = 0; i < 5; ++i) d.feed(frame(Mci::MCI_RUNNING));
  ASSERT_EQ(d.state(), State::Scanning);
  // Cycles from before the session took the new plan speak of the old one.
  EgmCycle stale = frame(Mci::MCI_RUNNING, true);
  stale.report.phase = robot::EgmPhase::Holding;
  for (int i = 0; i < 4; ++i) d.feed(stale).feed(LaserBytes{}).feed(Tick{}, 0.1);
  EXPECT_EQ(d.state(), State::Scanning);
  d.feed(frame(Mci::MCI_RUNNING)).feed(stale).feed(LaserBytes{}).feed(Tick{}, 0.2);
  EXPECT_EQ(d.state(), State::Localizing);
}

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

/// The answer to the query that a tick asks.
RobotReply progress(Driver& d, int done, int allowed, bool running = true) {
  d.feed(Tick{}, 0.5);
  const auto asked = d.of<RobotRequest>(d.last);
  EXPECT_EQ(asked.size(), 1U);
  RobotReply reply;
  if (asked.empty()) return reply;
  EXPECT_EQ(asked[0].task, RobotTask::Query);
  reply.id = asked[0].id;
  reply.ok = true;
  reply.running = running;
  reply.seams_done = reply.seams_begun = done;
  reply.seams_allowed = allowed;
  return reply;
}

TEST(CellRecovery, EachSeamIsLetBeginOnceTheOneBeforeHasEnded) {
  Driver d;
  ASSERT_EQ(weld(d).state(), State::Welding);
  for (int done = 0; done < 2; ++done) {
    d.feed(progress(d, done, done));
    const auto allow = d.of<RobotRequest>(d.last);
    ASSERT_EQ(allow.size(), 1U) << done;
    EXPECT_EQ(allow[0].task, RobotTask::Allow);
    EXPECT_EQ(allow[0].allowed_seams, done + 1);
    d.robot_done();
    d.feed(progress(d, done, done + 1));
    EXPECT_TRUE(d.of<RobotRequest>(d.last).empty()) << "let begin twice";
  }
  d.feed(progress(d, 2, 2));
  EXPECT_TRUE(d.of<RobotRequest>(d.last).empty()) << "there is no third seam";
  d.feed(progress(d, 2, 2, false));
  EXPECT_EQ(d.state(), State::Done);
}

TEST(CellRecovery, AProgressThatIsNotSavedLetsNoSeamBegin) {
  Driver d;
  weld(d).feed(progress(d, 1, 1));
  const auto saved = std::find_if(d.last.begin(), d.last.end(),
                                  [](const Output& o) { return std::holds_alternative<SaveState>(o); });
  const auto allow = std::find_if(d.last.begin(), d.last.end(), [](const Output& o) {
    const auto* r = std::get_if<RobotRequest>(&o);
    return r != nullptr && r->task == RobotTask::Allow;
  });
  ASSERT_NE(allow, d.last.end());
  EXPECT_LT(saved, allow) << "what comes before it in the step must be durable first";
}

TEST(CellRecovery, AFailedQueryWhileWeldingIsAFaultThatStops) {
  Driver d;
  weld(d);
  RobotReply failed = progress(d, 0, 0);
  failed.ok = false;
  failed.text = "the connection was refused";
  d.feed(failed);
  EXPECT_EQ(d.state(), State::Faulted);
  EXPECT_EQ(d.cell.status().fault, FaultCode::RobotCommand);
  EXPECT_NE(d.cell.status().fault_text.find("connection was refused"), std::string::npos);
  EXPECT_FALSE(d.cell.status().armed);
  EXPECT_EQ(d.of<RobotRequest>(d.last).back().task, RobotTask::Stop);
}

TEST(CellRecovery, AWeldProgramThatStopsEarlyTellsTheSeamAndTheControllersEvent) {
  Driver d;
  weld(d);
  RobotReply stopped = progress(d, 1, 2, false);
  stopped.text = "50204 Motion supervision";
  d.feed(stopped);
  EXPECT_EQ(d.state(), State::Faulted);
  EXPECT_EQ(d.cell.status().fault, FaultCode::ProgramStopped);
  EXPECT_NE(d.cell.status().fault_text.find("seam 1 of 2"), std::string::npos);
  EXPECT_NE(d.cell.status().fault_text.find("50204"), std::string::npos);
  EXPECT_FALSE(d.cell.status().armed);
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
