// Programmed motion and welding: where the torch goes, how fast, and what stops it.
#include <fmt/format.h>

#include <cmath>

#include "fixture.hpp"

namespace weldcell::sim {

namespace {

/// A tool looking straight out of the flange, 200 mm long.
constexpr const char* kHead = R"(MODULE W
 PERS tooldata tTorch:=[TRUE,[[0,0,200],[1,0,0,0]],[4.5,[0,0,100],[1,0,0,0],0,0,0]];
 PERS wobjdata wPart:=[FALSE,TRUE,"",[[900,0,600],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
 PERS seamdata sm:=[0.2,0.2,[0,0,0,0,0,0,0,0,0],0,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.5,[0,0,22,100,0,0,0,0,0],0.05,0,[0,0,0,0,0,0,0,0,0],0.5];
 PERS welddata wd:=[10,10,[0,0,24,130,0,0,0,0,0],[0,0,24,130,0,0,0,0,0]];
 PERS num nDone:=0;
 CONST jointtarget jHome:=[[0,0,0,0,90,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
 CONST robtarget pA:=[[0,0,50],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
 CONST robtarget pB:=[[0,100,50],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
 CONST robtarget pC:=[[60,100,50],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
 CONST robtarget pWrong:=[[0,100,50],[0,0,1,0],[0,1,0,1],[9E9,9E9,9E9,9E9,9E9,9E9]];
 CONST robtarget pFar:=[[3000,0,50],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
)";

std::string program(const std::string& body) {
  return std::string(kHead) + " PROC main()\n MoveAbsJ jHome,v500,fine,tTorch;\n" + body +
         "\n nDone:=1;\n ENDPROC\nENDMODULE";
}

Eigen::Vector3d tcp(const Bench& bench) {
  Eigen::Isometry3d tool = Eigen::Isometry3d::Identity();
  tool.translation().z() = 200;
  return (kinematics::forward(test_arm(), bench.controller.joints()).iso * tool).translation();
}

}  // namespace

TEST(Motion, LineIsStraightAndKeepsItsSpeed) {
  Bench bench;
  bench.run_program(
      program(
          " MoveJ pA,v200,fine,tTorch\\WObj:=wPart;\n nDone:=0.5;\n MoveL pC,v100,fine,tTorch\\WObj:=wPart;"),
      "W", "main");
  while (bench.value("W", "nDone") == "0") bench.step();
  bench.step(5);
  const Eigen::Vector3d a(900, 0, 650), c(960, 100, 650), along = (c - a).normalized();
  ASSERT_LT((tcp(bench) - a).norm(), 0.5) << bench.last_events();
  double fastest = 0, sideways = 0;
  Eigen::Vector3d last = tcp(bench);
  while (bench.controller.program_running()) {
    bench.step();
    const Eigen::Vector3d now = tcp(bench);
    fastest = std::max(fastest, (now - last).norm() / 0.004);
    sideways = std::max(sideways, ((now - a) - along * along.dot(now - a)).norm());
    last = now;
  }
  bench.step(10);
  EXPECT_EQ(bench.value("W", "nDone"), "1") << bench.last_events();
  EXPECT_NEAR((tcp(bench) - c).norm(), 0, 1e-3);
  EXPECT_NEAR(fastest, 100, 1);
  EXPECT_LT(sideways, 0.02);
}

TEST(Motion, StartsAndStopsWithoutJumps) {
  Bench bench;
  bench.run_program(program(" MoveJ pA,v500,z10,tTorch\\WObj:=wPart;\n MoveL "
                            "pB,v500,z10,tTorch\\WObj:=wPart;\n MoveL pC,v500,fine,tTorch\\WObj:=wPart;"),
                    "W", "main");
  kinematics::Joints last = bench.controller.joints(), speed{};
  double hardest = 0;
  for (int k = 0; k < 3000 && bench.controller.program_running(); ++k) {
    bench.step();
    for (std::size_t i = 0; i < 6; ++i) {
      const double now = (bench.controller.joints()[i] - last[i]) / 0.004;
      hardest = std::max(hardest, std::abs(now - speed[i]) / 0.004 / test_arm().max_speed[i]);
      speed[i] = now;
    }
    last = bench.controller.joints();
  }
  EXPECT_EQ(bench.value("W", "nDone"), "1") << bench.last_events();
  // Full speed is never reached in less than about a quarter of a second.
  EXPECT_LT(hardest, 2 / 0.3);
}

TEST(Motion, CircleGoesThroughItsPoint) {
  Bench bench;
  bench.run_program(
      program(" MoveJ pA,v200,fine,tTorch\\WObj:=wPart;\n MoveC pB,pC,v50,fine,tTorch\\WObj:=wPart;"), "W",
      "main");
  double nearest = 1e9;
  for (int k = 0; k < 5000 && bench.controller.program_running(); ++k) {
    bench.step();
    nearest = std::min(nearest, (tcp(bench) - Eigen::Vector3d(900, 100, 650)).norm());
  }
  bench.step(10);
  EXPECT_LT(nearest, 0.2) << bench.last_events();
  EXPECT_NEAR((tcp(bench) - Eigen::Vector3d(960, 100, 650)).norm(), 0, 1e-3);
}

TEST(Motion, WrongConfigurationStopsWithAnEvent) {
  Bench bench;
  bench.run_program(program(" ConfL\\On;\n MoveJ pA,v200,fine,tTorch\\WObj:=wPart;\n MoveL "
                            "pWrong,v100,fine,tTorch\\WObj:=wPart;"),
                    "W", "main");
  ASSERT_TRUE(bench.finish(20));
  EXPECT_EQ(bench.value("W", "nDone"), "0");
  EXPECT_EQ(bench.controller.events().back().code, 50080);

  Bench loose;
  loose.run_program(program(" ConfL\\Off;\n MoveJ pA,v200,fine,tTorch\\WObj:=wPart;\n MoveL "
                            "pWrong,v100,fine,tTorch\\WObj:=wPart;"),
                    "W", "main");
  ASSERT_TRUE(loose.finish(20));
  EXPECT_EQ(loose.value("W", "nDone"), "1") << loose.last_events();
}

TEST(Motion, OutOfReachStopsWithAnEvent) {
  Bench bench;
  bench.run_program(program(" MoveJ pFar,v200,fine,tTorch\\WObj:=wPart;"), "W", "main");
  ASSERT_TRUE(bench.finish(20));
  EXPECT_EQ(bench.controller.events().back().code, 50050);
}

TEST(Motion, StopOnThePathAndGoOn) {
  Bench bench;
  bench.run_program(
      program(" MoveJ pA,v200,fine,tTorch\\WObj:=wPart;\n MoveL pB,v50,fine,tTorch\\WObj:=wPart;"), "W",
      "main");
  while (tcp(bench).y() < 40) bench.step();
  ASSERT_EQ(bench.rws("POST", "/rw/rapid/execution?action=stop", "stopmode=stop").status, 204);
  bench.step(60);
  const Eigen::Vector3d rest = tcp(bench);
  EXPECT_LT(rest.y(), 50);
  bench.step(50);
  EXPECT_LT((tcp(bench) - rest).norm(), 1e-6);
  ASSERT_EQ(bench.rws("POST", "/rw/rapid/execution?action=start", Bench::kStart).status, 204);
  ASSERT_TRUE(bench.finish(10));
  bench.step(10);
  EXPECT_NEAR(tcp(bench).y(), 100, 1e-3);
}

TEST(Weld, TraceFollowsTheSeamAtWeldSpeed) {
  Scene scene = test_scene();
  workpiece::Weld weld;
  weld.name = "w1";
  weld.joins = {"bar"};
  weld.start = {100, 0, 40};
  workpiece::SeamPiece piece;
  piece.to = {160, 100, 40};
  weld.pieces = {piece};
  scene.workpiece.welds = {weld};
  Bench bench(scene);
  bench.run_program(program(" MoveJ pA,v200,fine,tTorch\\WObj:=wPart;\n"
                            " ArcLStart pA,v100,sm,wd,fine,tTorch\\WObj:=wPart\\SeamName:=\"first\";\n"
                            " ArcL pB,v100,sm,wd,z1,tTorch\\WObj:=wPart;\n"
                            " ArcLEnd pC,v100,sm,wd,fine,tTorch\\WObj:=wPart;"),
                    "W", "main");
  ASSERT_TRUE(bench.finish(40)) << bench.last_events();
  EXPECT_EQ(bench.value("W", "nDone"), "1") << bench.last_events();
  ASSERT_EQ(bench.controller.weld_traces().size(), 1U);
  const WeldTrace& trace = bench.controller.weld_traces()[0];
  EXPECT_EQ(trace.seam, "first");
  EXPECT_LT((trace.tcp_mm.front() - Eigen::Vector3d(900, 0, 650)).norm(), 0.3);
  EXPECT_LT((trace.tcp_mm.back() - Eigen::Vector3d(960, 100, 650)).norm(), 0.3);
  // The true seam runs straight from (900, 0) to (960, 100); the torch went round by (900, 100).
  const auto errors = welded_seams(scene, bench.controller.weld_traces());
  ASSERT_EQ(errors.size(), 1U);
  EXPECT_EQ(errors[0].seam, "w1");
  EXPECT_NEAR(errors[0].lateral_error_mm, 100 * 60 / std::hypot(100, 60), 0.5);
}

}  // namespace weldcell::sim
