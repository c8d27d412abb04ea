#include "driver.hpp"

namespace weldcell::job {
namespace {

TEST(Cell, MovesNothingBeforeArmAndStart) {
  Driver d;
  d.ready(true);
  ASSERT_EQ(d.state(), State::Ready);
  d.order(wire::PlcCommand::Start);
  EXPECT_EQ(d.state(), State::Ready);
  for (int i = 0; i < 100; ++i) d.feed(Tick{}, 1);
  EXPECT_FALSE(moves(d.all));
  d.order(wire::PlcCommand::Arm);
  EXPECT_FALSE(moves(d.all));
  d.order(wire::PlcCommand::Start);
  EXPECT_EQ(d.state(), State::GuideMoving);
  EXPECT_TRUE(moves(d.last));
}

TEST(Cell, StartNeedsItsLinks) {
  Driver d(true);
  d.ready(false).order(wire::PlcCommand::Arm).order(wire::PlcCommand::Start);
  EXPECT_EQ(d.state(), State::Ready) << "the PLC is missing";
  d.feed(LinkChange{Link::Plc, true, ""})
      .feed(LinkChange{Link::Laser, false, "gone"})
      .order(wire::PlcCommand::Start);
  EXPECT_EQ(d.state(), State::Ready) << "the laser is missing";
  d.feed(LinkChange{Link::Laser, true, ""}).order(wire::PlcCommand::Start);
  EXPECT_EQ(d.state(), State::PreparingScan);
}

TEST(Cell, GuidesStepByStepThenScans) {
  Driver d;
  d.ready(true).order(wire::PlcCommand::Arm).order(wire::PlcCommand::Start);
  d.robot_done();
  EXPECT_EQ(d.state(), State::Placing);
  EXPECT_EQ(d.cell.status().guide_step, 1);
  d.order(wire::PlcCommand::Confirm).robot_done();
  EXPECT_EQ(d.cell.status().guide_step, 2);
  d.order(wire::PlcCommand::Confirm);
  EXPECT_EQ(d.state(), State::PreparingScan);
  ASSERT_FALSE(d.of<RobotRequest>(d.last).empty());
  EXPECT_EQ(d.of<RobotRequest>(d.last).front().task, RobotTask::OpenScan);
}

TEST(Cell, AFaultStopsDisarmsAndKeepsTheJob) {
  Driver d;
  d.ready(false).order(wire::PlcCommand::Arm).order(wire::PlcCommand::Start);
  d.feed(Tick{}, 31);  // EGM never opens
  EXPECT_EQ(d.state(), State::Faulted);
  EXPECT_EQ(d.cell.status().fault, FaultCode::EgmNotStarted);
  EXPECT_FALSE(d.cell.status().armed);
  EXPECT_EQ(d.of<StopMotion>(d.last).size(), 1u);
  EXPECT_FALSE(d.of<SetArmed>(d.last).front().armed);
  const std::size_t before = d.all.size();
  d.order(wire::PlcCommand::Resume);
  EXPECT_EQ(d.state(), State::Faulted) << "not armed";
  d.order(wire::PlcCommand::Arm).order(wire::PlcCommand::Resume);
  EXPECT_EQ(d.state(), State::Importing);
  d.feed(ImportDone{part()}).feed(PlanDone{prepared()});
  EXPECT_EQ(d.state(), State::PreparingScan);
  EXPECT_GT(d.all.size(), before);
}

TEST(Cell, AnInterruptedJobWaitsForArmAndResume) {
  Driver d;
  d.feed(LinkChange{Link::Laser, true, ""}).feed(LinkChange{Link::Rws, true, ""});
  JobArrived arrived;
  arrived.id = arrived.order.name = "job";
  arrived.interrupted = true;
  arrived.guidance_done = true;
  d.feed(arrived);
  EXPECT_EQ(d.state(), State::Interrupted);
  d.order(wire::PlcCommand::Start).order(wire::PlcCommand::Confirm).order(wire::PlcCommand::Resume);
  EXPECT_EQ(d.state(), State::Interrupted);
  EXPECT_FALSE(moves(d.all));
  d.order(wire::PlcCommand::Arm).order(wire::PlcCommand::Resume);
  d.feed(ImportDone{part()}).feed(PlanDone{prepared()});
  EXPECT_EQ(d.state(), State::PreparingScan) << "guidance was done";
}

TEST(Cell, APlcCommandCountsOnceAndOnlyWhenItsNumberChanges) {
  Driver d;
  wire::PlcOrder order;
  order.command = wire::PlcCommand::Arm;
  order.command_sequence = 5;
  d.feed(PlcInput{order});
  EXPECT_FALSE(d.cell.status().armed) << "what stood there at connection is no order";
  order.command_sequence = 6;
  d.feed(PlcInput{order});
  EXPECT_TRUE(d.cell.status().armed);
  EXPECT_EQ(d.cell.status().plc.command_ack, 6);
  EXPECT_EQ(d.cell.status().plc.command_result, 0);
  order.command = static_cast<wire::PlcCommand>(77);
  order.command_sequence = 7;
  d.feed(PlcInput{order});
  EXPECT_EQ(d.cell.status().plc.command_result, 2);
  order.command = wire::PlcCommand::Start;
  order.command_sequence = 8;
  d.feed(PlcInput{order});
  EXPECT_EQ(d.cell.status().plc.command_result, 1);
}

TEST(Cell, AnUnreadableWorkpieceFailsTheJobAndStaysUp) {
  Driver d;
  JobArrived arrived;
  arrived.id = arrived.order.name = "job";
  d.feed(arrived).feed(ImportDone{Error{"cad.units", "a.dxf", "no units", "state them"}});
  EXPECT_EQ(d.state(), State::Failed);
  const auto finished = d.of<FinishJob>(d.last);
  ASSERT_EQ(finished.size(), 1u);
  EXPECT_FALSE(finished[0].accepted);
  EXPECT_NE(finished[0].reason.find("no units"), std::string::npos);
  EXPECT_NE(finished[0].reason.find("weld manually"), std::string::npos);
  EXPECT_TRUE(d.cell.takes_jobs());
}

TEST(Cell, ASeamWhoseArcWasBegunIsNeverWeldedAgain) {
  Driver d;
  d.feed(LinkChange{Link::Laser, true, ""}).feed(LinkChange{Link::Rws, true, ""});
  JobArrived arrived;
  arrived.id = arrived.order.name = "job";
  arrived.interrupted = arrived.guidance_done = arrived.weld_begun = true;
  d.feed(arrived).order(wire::PlcCommand::Arm).order(wire::PlcCommand::Resume);
  const auto asked = d.of<RobotRequest>(d.last);
  ASSERT_EQ(asked.size(), 2u);
  EXPECT_EQ(asked[0].task, RobotTask::Stop);
  ASSERT_EQ(asked[1].task, RobotTask::Query);
  RobotReply reply;
  reply.id = asked[1].id;
  reply.ok = true;
  reply.seams_begun = 1;  // one of two, its end never reached
  d.feed(reply);
  EXPECT_EQ(d.cell.status().seams_done, 1);
  const auto saved = d.of<SaveState>(d.last);
  ASSERT_FALSE(saved.empty());
  EXPECT_TRUE(saved.back().weld_begun);
  EXPECT_EQ(saved.back().seams_done, 1);
}

TEST(Cell, ALateAnswerOfAnEarlierRequestMovesNothing) {
  Driver d;
  d.ready(true).order(wire::PlcCommand::Arm).order(wire::PlcCommand::Start);
  const auto first = d.of<RobotRequest>(d.last).back();
  d.order(wire::PlcCommand::Stop);
  EXPECT_EQ(d.state(), State::Faulted);
  RobotReply late;
  late.id = first.id;
  late.ok = true;
  d.feed(late);
  EXPECT_EQ(d.state(), State::Faulted);
}

TEST(Cell, EveryFaultNumberStandsInTheAlarmList) {
  for (const FaultCode code :
       {FaultCode::EgmLost, FaultCode::EgmNotStarted, FaultCode::MotionRefused, FaultCode::RobotStopped,
        FaultCode::LaserLost, FaultCode::LaserOverrun, FaultCode::RobotCommand, FaultCode::ProgramStopped,
        FaultCode::PlcLost, FaultCode::StoppedByPerson, FaultCode::Held, FaultCode::StateNotSaved}) {
    EXPECT_STRNE(to_string(code), "?") << static_cast<int>(code);
  }
}

TEST(Cell, AFaultIsClearedToStoppedAndAHoldIsHeld) {
  Driver d;
  d.ready(true).order(wire::PlcCommand::Arm).order(wire::PlcCommand::Start);
  EXPECT_EQ(d.cell.status().plc.state, wire::PackState::Execute);
  d.order(wire::PlcCommand::Hold);
  EXPECT_EQ(d.cell.status().plc.state, wire::PackState::Held);
  EXPECT_EQ(d.cell.status().plc.fault_code, 51);
  EXPECT_FALSE(d.cell.status().armed);
  d.order(wire::PlcCommand::Unhold);
  EXPECT_EQ(d.state(), State::Faulted) << "not armed";
  d.order(wire::PlcCommand::Arm).order(wire::PlcCommand::Unhold);
  EXPECT_EQ(d.state(), State::Importing);
  d.feed(StorageLost{"disk full"});
  EXPECT_EQ(d.cell.status().plc.state, wire::PackState::Aborted);
  EXPECT_EQ(d.cell.status().plc.fault_code, 60);
  EXPECT_EQ(d.cell.status().plc.fault_severity, wire::PlcSeverity::Fault);
  d.order(wire::PlcCommand::Clear);
  EXPECT_EQ(d.cell.status().plc.state, wire::PackState::Stopped);
  EXPECT_EQ(d.state(), State::Faulted);
}

TEST(Cell, ALatencyThatDriftsIsToldOnceAndShownToThePlc) {
  Driver d;
  d.ready(false);
  const auto warnings_of = [&](double latency_ms, bool watched) {
    CellMemory memory = d.cell.memory();
    memory.state = State::Localizing;
    memory.watches_latency = watched;
    d.cell.recall(memory);
    auto solution = std::make_shared<Solution>();
    solution->verdict.verdict = localize::Verdict::Weld;
    solution->found.latency_s = latency_ms * 1e-3;
    d.feed(SolveDone{solution});
    EXPECT_EQ(d.state(), State::Uploading);
    const auto events = d.of<LogEvent>(d.last);
    return std::count_if(events.begin(), events.end(), [](const LogEvent& e) {
      return e.text.find("latency has drifted") != std::string::npos;
    });
  };
  for (int i = 0; i < 5; ++i) EXPECT_EQ(warnings_of(3, false), 0) << "a record of before";
  EXPECT_EQ(warnings_of(1.6, true), 0);
  EXPECT_EQ(warnings_of(1.6, true), 0);
  EXPECT_EQ(d.cell.status().plc.fault_code, 0);
  EXPECT_EQ(warnings_of(1.6, true), 1) << "three jobs agree: more than twice the sigma of 0.5 ms";
  EXPECT_EQ(d.cell.status().plc.fault_code, wire::kAlarmLatency);
  EXPECT_EQ(d.cell.status().plc.fault_severity, wire::PlcSeverity::Warning);
  EXPECT_EQ(warnings_of(1.6, true), 0) << "told already";
  for (int i = 0; i < 10; ++i) EXPECT_EQ(warnings_of(0, true), 0);
  EXPECT_EQ(d.cell.status().plc.fault_code, 0);
}

TEST(Cell, SelectPutsAReadyJobBackUnbegun) {
  Driver d;
  d.ready(true).order(wire::PlcCommand::Arm);
  PlcInput input;
  input.order.command_sequence = 1;
  d.feed(input);
  input.order.command = wire::PlcCommand::Start;
  input.order.job_number = 77;
  ++input.order.command_sequence;
  d.feed(input);
  EXPECT_EQ(d.state(), State::Ready) << "another job is meant";
  EXPECT_EQ(d.cell.status().plc.command_result, static_cast<int>(wire::PlcResult::OtherJob));
  input.order.command = wire::PlcCommand::Select;
  ++input.order.command_sequence;
  d.feed(input);
  EXPECT_EQ(d.state(), State::Idle);
  EXPECT_FALSE(d.cell.status().armed);
  EXPECT_EQ(d.of<ReturnJob>(d.last).size(), 1U);
  EXPECT_EQ(d.cell.status().plc.selected_job, 77);
  JobArrived other;
  other.order.name = "other";
  other.order.number = 5;
  d.feed(other);
  EXPECT_EQ(d.state(), State::Idle) << "it is not the one chosen";
  EXPECT_EQ(d.of<ReturnJob>(d.last).size(), 1U);
  other.order.number = 77;
  d.feed(other);
  EXPECT_EQ(d.state(), State::Importing);
  EXPECT_EQ(d.cell.status().plc.selected_job, 0);
}

}  // namespace
}  // namespace weldcell::job
