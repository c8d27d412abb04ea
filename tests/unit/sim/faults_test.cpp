// What befalls a controller from outside: its events, its states, and the record of what the arm did.
#include <unistd.h>

#include "fixture.hpp"
#include "sim/fault_input.hpp"
#include "weldcell/sim/fault_schedule.hpp"

namespace weldcell::sim {

namespace {

constexpr const char* kTravel = R"(MODULE F
 PERS tooldata tHead:=[TRUE,[[0,0,0],[1,0,0,0]],[6.5,[0,0,110],[1,0,0,0],0,0,0]];
 CONST jointtarget jA:=[[0,0,0,0,90,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
 CONST jointtarget jB:=[[60,0,0,0,90,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
 PROC main()
  MoveAbsJ jB,v300,fine,tHead;
  MoveAbsJ jA,v300,fine,tHead;
 ENDPROC
ENDMODULE)";

bool logged(const Bench& bench, int code) {
  for (const Event& event : bench.controller.events()) {
    if (event.code == code) return true;
  }
  return false;
}

}  // namespace

TEST(Faults, MotionSupervisionStopsTheProgramAtOnceAndLeavesTheMotorsOn) {
  Bench bench;
  bench.run_program(kTravel, "F", "main");
  bench.step(250);
  ASSERT_TRUE(bench.controller.program_running());
  const double at_s = seconds(bench.now().ns);
  ASSERT_TRUE(bench.controller.inject("collision"));
  bench.step(250);
  EXPECT_FALSE(bench.controller.program_running());
  EXPECT_TRUE(bench.controller.motors_on());
  EXPECT_TRUE(logged(bench, 50204)) << bench.last_events();
  ASSERT_EQ(bench.controller.motions().size(), 1U);
  EXPECT_GT(bench.controller.motions()[0].end_s, at_s);
  EXPECT_LT(bench.controller.motions()[0].end_s, at_s + 0.1) << "it did not stop at once";
}

TEST(Faults, AMovedPointerStopsFirstAndStartsFromMainAgain) {
  Bench bench;
  bench.run_program(kTravel, "F", "main");
  bench.step(250);
  ASSERT_TRUE(bench.controller.inject("pp_moved"));
  EXPECT_FALSE(bench.controller.program_running());
  EXPECT_FALSE(logged(bench, 10002)) << "moved before the arm stood";
  bench.step(250);
  EXPECT_TRUE(logged(bench, 10002)) << bench.last_events();
  EXPECT_EQ(bench.rws("POST", "/rw/rapid/execution?action=start", Bench::kStart).status, 204);
  ASSERT_TRUE(bench.finish(20)) << bench.last_events();
  bench.step(10);
  EXPECT_NEAR(bench.controller.joints()[0], 0, 1e-6) << "main ran to its end from where the arm stood";
}

TEST(Faults, ASingularityStopsTheNextMove) {
  Bench bench;
  bench.run_program(kTravel, "F", "main");
  bench.step(250);
  ASSERT_TRUE(bench.controller.inject("singularity"));
  ASSERT_TRUE(bench.finish(20));
  bench.step(50);
  EXPECT_TRUE(logged(bench, 50026)) << bench.last_events();
  EXPECT_NEAR(bench.controller.joints()[0], rad(60), 1e-6) << "the move under way was carried out";
}

TEST(Faults, MotorsOnByTheButtonNeedsTheEmergencyStopReleased) {
  Bench bench;
  bench.controller.inject("estop", 1);
  bench.controller.inject("motors_on");
  EXPECT_FALSE(bench.controller.motors_on());
  bench.step(300);
  EXPECT_FALSE(bench.controller.motors_on()) << "released, and nothing more";
  bench.controller.inject("motors_on");
  EXPECT_TRUE(bench.controller.motors_on());
}

TEST(Faults, EveryMotionIsRecordedAndRestIsNot) {
  Bench bench;
  bench.step(500);
  EXPECT_TRUE(bench.controller.motions().empty());
  bench.run_program(kTravel, "F", "main");
  ASSERT_TRUE(bench.finish(20));
  bench.step(500);
  ASSERT_FALSE(bench.controller.motions().empty());
  const MotionSpan first = bench.controller.motions().front(), last = bench.controller.motions().back();
  EXPECT_GE(first.begin_s, 2);
  EXPECT_GT(last.end_s, first.begin_s);
  EXPECT_LT(last.end_s, seconds(bench.now().ns) - 1.5);
}

TEST(Faults, AScheduleCountsFromTheFirstArc) {
  Scene scene = test_scene();
  Bench bench(scene);
  FaultSchedule schedule(
      {{"estop", TimedFault::After::Weld, 0, 0}, {"manual", TimedFault::After::Start, 1, 0}});
  EXPECT_TRUE(schedule.due(HostTime{kSecond / 2}, bench.controller).empty());
  const auto due = schedule.due(HostTime{kSecond}, bench.controller);
  ASSERT_EQ(due.size(), 1U);
  EXPECT_EQ(due[0].kind, "manual");
  EXPECT_TRUE(schedule.due(HostTime{9 * kSecond}, bench.controller).empty()) << "each once, and no arc yet";
}

TEST(Faults, OneThatComesLaterCountsFromThen) {
  Scene scene = test_scene();
  Bench bench(scene);
  FaultSchedule schedule({});
  schedule.add({"manual", TimedFault::After::Start, 2, 0}, HostTime{5 * kSecond});
  EXPECT_TRUE(schedule.due(HostTime{6 * kSecond}, bench.controller).empty());
  EXPECT_EQ(schedule.due(HostTime{7 * kSecond}, bench.controller).size(), 1U);
}

TEST(Faults, LinesAreTakenWholeAndAnythingElseIsNoFault) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  const auto say = [&](const std::string& text) {
    ASSERT_EQ(::write(ends[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
  };
  FaultInput input(ends[0]);
  EXPECT_TRUE(input.take().empty()) << "nothing is there, and it does not wait";
  say("estop@scan+2:3\nbang@1\n\nmanu");
  const auto first = input.take();
  ASSERT_EQ(first.size(), 1U);
  EXPECT_EQ(first[0].kind, "estop");
  EXPECT_EQ(first[0].after, TimedFault::After::Scan);
  say("al\n");
  const auto second = input.take();
  ASSERT_EQ(second.size(), 1U);
  EXPECT_EQ(second[0].kind, "manual");
  ::close(ends[1]);
  EXPECT_TRUE(input.take().empty());
  ::close(ends[0]);
}

TEST(RwsLoad, CountsWhatArrivesWithinASecondRefusedOrNot) {
  RwsLoad load(3);
  EXPECT_TRUE(load.admit(0));
  EXPECT_TRUE(load.admit(0.5));
  EXPECT_TRUE(load.admit(0.9));
  EXPECT_FALSE(load.admit(0.95));
  EXPECT_TRUE(load.admit(1.0)) << "the first is a second old";
  EXPECT_EQ(load.most_in_a_second(), 4U);
  EXPECT_EQ(load.total(), 5U);
  EXPECT_EQ(load.refused(), 1U);
}

}  // namespace weldcell::sim
