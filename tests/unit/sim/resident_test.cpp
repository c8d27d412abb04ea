// The shipped resident module on the simulated controller: loaded as either generation loads it, followed,
// stopped from outside, left in silence and begun again without a reset.
#include <fstream>
#include <sstream>

#include "egm_messages.hpp"
#include "fixture.hpp"

namespace weldcell::sim {
namespace {

using kinematics::Joints;

constexpr Joints kHome{0, 0, 0, 0, 90, 0};

std::string shipped(const std::string& name) {
  std::ifstream in(std::string(WELDCELL_CONFIG) + "/rapid/" + name, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  EXPECT_TRUE(in.good()) << name;
  return text.str();
}

constexpr const char* kStart = "value=[[0,0,0,0,90,0],[9E9,9E9,9E9,9E9,9E9,9E9]]";

/// Loads the module, writes the start posture and runs a routine, as the generation's clients do.
void run(Bench& bench, const std::string& routine) {
  EXPECT_EQ(
      bench.rws("POST", "/rw/rapid/symbol/data/RAPID/T_ROB1/WeldcellEgm/jWeldcellStart?action=set", kStart)
          .status,
      204);
  EXPECT_EQ(bench
                .rws("POST", "/rw/rapid/tasks/T_ROB1/pcp?action=set-pp-routine",
                     "module=WeldcellEgm&routine=" + routine)
                .status,
            204);
  EXPECT_EQ(bench.rws("POST", "/rw/rapid/execution?action=start", Bench::kStart).status, 204);
}

void load(Bench& bench) {
  EXPECT_EQ(bench.rws("POST", "/rw/panel/ctrlstate?action=setctrlstate", "ctrl-state=motoron").status, 204);
  EXPECT_EQ(bench.rws("PUT", "/fileservice/$home/WeldcellEgm.mod", shipped("WeldcellEgm.mod")).status, 201);
  EXPECT_EQ(bench.rws("POST", "/rw/mastership/rapid?action=request").status, 204);
  const auto loaded = bench.rws("POST", "/rw/rapid/tasks/T_ROB1?action=loadmod",
                                "modulepath=$HOME/WeldcellEgm.mod&replace=true");
  EXPECT_EQ(loaded.status, 204) << loaded.body;
}

std::string state(Bench& bench) { return bench.value("WeldcellEgm", "nWeldcellState"); }

void follow(Bench& bench, int cycles) {
  for (int k = 0; k < cycles; ++k) {
    bench.controller.on_egm_datagram(sensor(kHome, {}));
    bench.step();
  }
}

TEST(ResidentModule, LoadsAndMovesInBothGenerations) {
  Bench six;
  load(six);
  run(six, "WeldcellMove");
  ASSERT_TRUE(six.finish(5)) << six.last_events();
  EXPECT_EQ(state(six), "2");

  Two seven;
  for (const char* name : {"WeldcellEgm", "WeldcellMain"}) {
    const std::string file = std::string(name) + ".modx";
    EXPECT_EQ(
        seven.controller
            .handle_rws({"PUT", "/fileservice/HOME/" + file, shipped(file), "text/plain;v=2.0", kXhtml}, 1)
            .status,
        201);
    seven.ask("POST", "/rw/mastership/edit/request");
    const auto loaded =
        seven.ask("POST", "/rw/rapid/tasks/T_ROB1/loadmod", "modulepath=HOME/" + file + "&replace=true");
    EXPECT_EQ(loaded.status, 204) << loaded.body;
  }
  EXPECT_EQ(seven.ask("POST", "/rw/panel/ctrl-state", "ctrl-state=motoron").status, 204);
  EXPECT_EQ(seven.ask("POST", "/rw/rapid/symbol/RAPID/T_ROB1/WeldcellEgm/jWeldcellStart/data", kStart).status,
            204);
  EXPECT_EQ(seven
                .ask("POST", "/rw/rapid/tasks/T_ROB1/pcp/routine",
                     "routine=WeldcellMove&module=WeldcellEgm&userlevel=FALSE")
                .status,
            204);
  EXPECT_EQ(seven.ask("POST", "/rw/rapid/execution/start", Bench::kStart).status, 204);
  ASSERT_TRUE(seven.finish(5)) << seven.last_events();
  EXPECT_EQ(seven.json("/rw/rapid/symbol/RAPID/T_ROB1/WeldcellEgm/nWeldcellState/data")["state"][0]["value"],
            "2");
}

TEST(ResidentModule, MainMovesNothing) {
  Bench bench;
  const Joints before = bench.controller.joints();
  bench.run_program(shipped("WeldcellMain.mod"), "WeldcellMain", "main");
  ASSERT_TRUE(bench.finish(1)) << bench.last_events();
  EXPECT_EQ(bench.controller.joints(), before);
}

TEST(ResidentModule, StopFromOutsideEndsAScanInOrder) {
  Bench bench;
  load(bench);
  run(bench, "WeldcellScan");
  follow(bench, 100);
  ASSERT_EQ(state(bench), "3");
  ASSERT_TRUE(bench.controller.egm_guiding());
  const std::string stop = "/rw/rapid/symbol/data/RAPID/T_ROB1/WeldcellEgm/bWeldcellStop?action=set";
  EXPECT_EQ(bench.rws("POST", stop, "value=FALSE").status, 204);
  follow(bench, 20);
  EXPECT_TRUE(bench.controller.egm_guiding()) << "written again without a change";
  EXPECT_EQ(bench.rws("POST", stop, "value=TRUE").status, 204);
  for (int k = 0; k < 500 && bench.controller.program_running(); ++k) follow(bench, 1);
  EXPECT_FALSE(bench.controller.program_running());
  EXPECT_EQ(state(bench), "4");
  EXPECT_EQ(bench.last_events().find("41822"), std::string::npos);
  run(bench, "WeldcellScan");
  follow(bench, 100);
  EXPECT_EQ(state(bench), "3") << "the next scan begins with the request taken back";
}

TEST(ResidentModule, AfterSilenceTheNextScanNeedsNoReset) {
  Bench bench;
  load(bench);
  for (int again = 0; again < 3; ++again) {
    run(bench, "WeldcellScan");
    follow(bench, 100);
    ASSERT_EQ(state(bench), "3") << again << "\n" << bench.last_events();
    ASSERT_TRUE(bench.finish(3)) << "silence ends it";
    EXPECT_EQ(state(bench), "9");
  }
  run(bench, "WeldcellMove");
  ASSERT_TRUE(bench.finish(5));
  EXPECT_EQ(state(bench), "2");
}

}  // namespace
}  // namespace weldcell::sim
