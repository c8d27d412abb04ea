// EGM: the control law against its documented errors, the frame field by field, time-out and convergence.
#include <cmath>

#include "egm_messages.hpp"
#include "fixture.hpp"
#include "sim/egm_channel.hpp"

namespace weldcell::sim {

namespace {

using kinematics::Joints;

std::string guided(const std::string& options = "\\CommTimeout:=0.5",
                   const std::string& run = "\\CondTime:=1E+05", const std::string& minmax = "-1E-09,1E-09") {
  return "MODULE G\n PERS num nState:=0;\n VAR egmident id;\n CONST egm_minmax mm:=[" + minmax + R"(];
 PERS tooldata tHead:=[TRUE,[[0,0,0],[1,0,0,0]],[6.5,[0,0,110],[1,0,0,0],0,0,0]];
 PROC main()
  EGMReset id;
  WaitTime 0.005;
  EGMGetId id;
  EGMSetupUC ROB_1,id,"default","ROB_1"\Joint)" +
         options + R"(;
  EGMActJoint id\Tool:=tHead\J1:=mm\J2:=mm\J3:=mm\J4:=mm\J5:=mm\J6:=mm\LpFilter:=100\SampleRate:=4\MaxSpeedDeviation:=90;
  nState:=3;
  EGMRunJoint id,EGM_STOP_HOLD\J1\J2\J3\J4\J5\J6)" +
         run + R"(;
  EGMReset id;
  nState:=4;
 ERROR
  IF ERRNO=ERR_UDPUC_COMM THEN
   nState:=9;
   EGMReset id;
   RETURN;
  ENDIF
 ENDPROC
ENDMODULE)";
}

/// Steady error of the first axis behind a ramp of its reference.
double ramp_error_deg(double gain, double low_pass_hz, bool with_speed) {
  Scene scene = test_scene();
  scene.controller.position_gain = gain;
  scene.controller.low_pass_hz = low_pass_hz;
  Bench bench(scene);
  std::string text = guided();
  text.replace(text.find("\\LpFilter:=100"), 14, "\\LpFilter:=" + std::to_string(low_pass_hz));
  bench.run_program(text, "G", "main");
  bench.step(20);
  const double speed = 10;
  double reference = 0;
  for (int k = 0; k < 750; ++k) {
    reference += speed * 0.004;
    bench.controller.on_egm_datagram(
        sensor({reference, 0, 0, 0, 90, 0}, {with_speed ? speed : 0, 0, 0, 0, 0, 0}));
    bench.step();
  }
  EXPECT_TRUE(bench.controller.egm_guiding());
  return (reference - deg(bench.controller.joints()[0])) / speed;
}

}  // namespace

TEST(EgmControlLaw, RampErrorIsOneOverGainPlusDeadTime) {
  // MOTION.md 3.1: 21.6, 11.6, 6.6 mm at 100 mm/s for k = 5, 10, 20; 1.6 mm with speed reference.
  EXPECT_NEAR(ramp_error_deg(5, 20, false), 0.216, 0.001);
  EXPECT_NEAR(ramp_error_deg(10, 20, false), 0.116, 0.001);
  EXPECT_NEAR(ramp_error_deg(20, 100, false), 0.066, 0.001);
  EXPECT_NEAR(ramp_error_deg(20, 100, true), 0.016, 0.001);
  EXPECT_NEAR(ramp_error_deg(5, 20, true), 0.016, 0.0012);
}

TEST(EgmControlLaw, StepDecaysWithTheGain) {
  EgmChannel channel(test_arm(), 5, 0, 0.004);
  channel.get_id();
  channel.set_up(1);
  EgmActivation activation;
  activation.low_pass_hz = 0;
  activation.max_speed_deviation_rad_s = 10;
  ASSERT_TRUE(channel.activate(activation));
  EgmRun run;
  run.axes.fill(true);
  Joints position{}, speed{};
  ASSERT_TRUE(channel.run(run, position));
  for (int k = 0; k < 50; ++k) {  // 0.2 s = 1/k
    channel.on_datagram(sensor({1, 0, 0, 0, 0, 0}, {}));
    EXPECT_EQ(channel.step(position, speed), EgmChannel::Outcome::None);
  }
  EXPECT_NEAR(deg(position[0]), 1 - std::pow(1 - 5 * 0.004, 50), 1e-9);
}

TEST(EgmControlLaw, OneRatioCutsAllAxesAndUtilizationTells) {
  EgmChannel channel(test_arm(), 20, 0, 0.004);
  channel.get_id();
  channel.set_up(1);
  EgmActivation activation;
  activation.low_pass_hz = 0;                 // the channel's own default, which is no filter here
  ASSERT_TRUE(channel.activate(activation));  // MaxSpeedDeviation stays at 1 deg/s
  EgmRun run;
  run.axes.fill(true);
  Joints position{}, speed{};
  ASSERT_TRUE(channel.run(run, position));
  channel.on_datagram(sensor({10, 20, 0, 0, 0, 0}, {}));
  channel.step(position, speed);
  EXPECT_NEAR(deg(speed[1]), 1.0, 1e-9);
  EXPECT_NEAR(deg(speed[0]), 0.5, 1e-9);
  EXPECT_NEAR(robot(channel.frame({})).utilizationrate(), 100 * 400 / 175.0, 1e-6);
}

TEST(EgmFrame, HasTheShapeOfRobotWare610) {
  Bench bench;
  EXPECT_FALSE(bench.controller.egm_datagram());
  bench.run_program(guided(), "G", "main");
  std::vector<std::vector<std::byte>> frames;
  for (int k = 0; k < 30; ++k) {
    bench.step();
    if (auto frame = bench.controller.egm_datagram()) frames.push_back(*frame);
  }
  ASSERT_GT(frames.size(), 10U);
  std::uint32_t seqno = 0, last_tm = 0;
  for (const auto& bytes : frames) {
    const auto frame = robot(bytes);
    EXPECT_EQ(frame.header().seqno(), seqno++);
    EXPECT_EQ(frame.header().mtype(), abb::egm::EgmHeader::MSGTYPE_DATA);
    if (last_tm) {
      EXPECT_NEAR(frame.header().tm() - last_tm, 4, 1);
    }
    last_tm = frame.header().tm();
    EXPECT_EQ(frame.feedback().joints().joints_size(), 6);
    EXPECT_EQ(frame.planned().joints().joints_size(), 6);
    EXPECT_NEAR(frame.feedback().joints().joints(4), 90, 1e-6);
    ASSERT_TRUE(frame.feedback().cartesian().has_orient());
    ASSERT_TRUE(frame.feedback().cartesian().has_euler());
    EXPECT_NEAR(frame.feedback().cartesian().pos().x(), 945, 1e-6);
    EXPECT_NEAR(frame.feedback().cartesian().pos().z(), 1375, 1e-6);
    const double age_ms =
        frame.header().tm() - (frame.feedback().time().sec() * 1e3 + frame.feedback().time().usec() * 1e-3);
    EXPECT_GT(age_ms, 2.9);
    EXPECT_LT(age_ms, 5.1);
    EXPECT_NEAR(frame.header().tm() * 1e-3, 28397.2 + seconds(bench.now().ns), 0.2);
    EXPECT_EQ(frame.motorstate().state(), abb::egm::EgmMotorState::MOTORS_ON);
    EXPECT_EQ(frame.mcistate().state(), abb::egm::EgmMCIState::MCI_RUNNING);
    EXPECT_EQ(frame.rapidexecstate().state(), abb::egm::EgmRapidCtrlExecState::RAPID_RUNNING);
    EXPECT_FALSE(frame.mciconvergencemet());
    EXPECT_TRUE(frame.has_utilizationrate());
    EXPECT_FALSE(frame.has_moveindex());
  }
  // Doubles travel one by one: field 1, wire type 1, each with its own key.
  const std::string text(reinterpret_cast<const char*>(frames[0].data()), frames[0].size());
  EXPECT_NE(text.find(std::string("\x0A\x36\x09", 3)), std::string::npos);
}

TEST(Egm, SilenceEndsInTimeOutAndTheErrorHandler) {
  Bench bench;
  bench.run_program(guided(), "G", "main");
  bench.step(20);
  const Joints still{0, 0, 0, 0, 90, 0}, moving{20, 0, 0, 0, 0, 0};
  for (int k = 0; k < 25; ++k) {
    bench.controller.on_egm_datagram(sensor(still, moving, false));
    bench.step();
  }
  // Velocity goes on being executed until the time-out.
  const double before = deg(bench.controller.joints()[0]);
  bench.step(100);
  EXPECT_NEAR(deg(bench.controller.joints()[0]) - before, 20 * 0.4, 0.05);
  bool error_seen = false;
  for (int k = 0; k < 200 && bench.controller.program_running(); ++k) {
    bench.step();
    if (const auto frame = bench.controller.egm_datagram()) {
      error_seen |= robot(*frame).mcistate().state() == abb::egm::EgmMCIState::MCI_ERROR;
    }
  }
  EXPECT_TRUE(error_seen);
  EXPECT_FALSE(bench.controller.program_running());
  EXPECT_EQ(bench.value("G", "nState"), "9");
  EXPECT_NE(bench.last_events().find("41822"), std::string::npos);
  bench.step(10);  // the arm is one dead time behind its reference
  const Joints rest = bench.controller.joints();
  bench.step(20);
  EXPECT_EQ(bench.controller.joints(), rest);
  EXPECT_FALSE(bench.controller.egm_datagram());
}

TEST(Egm, ConvergenceEndsTheSessionByItself) {
  Bench bench;
  bench.run_program(guided("\\CommTimeout:=0.5", "\\CondTime:=1", "-0.5,0.5"), "G", "main");
  bench.step(20);
  int cycles = 0;
  while (bench.controller.program_running() && cycles < 1000) {
    bench.controller.on_egm_datagram(sensor({2, 0, 0, 0, 90, 0}, {}));
    bench.step();
    ++cycles;
  }
  EXPECT_EQ(bench.value("G", "nState"), "4");
  EXPECT_NEAR(cycles * 0.004, 1.0 + std::log(2 / 0.5) / 20, 0.15);
}

TEST(Egm, MalformedDatagramsAreCountedAndHarmless) {
  Bench bench;
  bench.run_program(guided(), "G", "main");
  bench.step(20);
  std::vector<std::vector<std::byte>> bad;
  bad.emplace_back();
  bad.emplace_back(2000, std::byte{0x55});
  bad.emplace_back(40, std::byte{0xFF});
  const auto good = sensor({0, 0, 0, 0, 90, 0}, {});
  bad.push_back({good.begin(), good.begin() + 20});
  bad.push_back(sensor({NAN, 0, 0, 0, 90, 0}, {}));
  bad.push_back(sensor({0, 0, 0, 0, 90, 0}, {INFINITY, 0, 0, 0, 0, 0}));
  for (const auto& datagram : bad) {
    bench.controller.on_egm_datagram(datagram);
    bench.controller.on_egm_datagram(good);
    bench.step(2);
  }
  EXPECT_EQ(bench.controller.malformed_egm_datagrams(), bad.size());
  EXPECT_TRUE(bench.controller.egm_guiding());
  EXPECT_NEAR(deg(bench.controller.joints()[0]), 0, 1e-9);
  EXPECT_NE(bench.last_events().find("Inbound UdpUc message invalid"), std::string::npos);
}

TEST(Egm, ReferenceOutOfRangeStopsTheProgram) {
  Bench bench;
  bench.run_program(guided(), "G", "main");
  bench.step(20);
  for (int k = 0; k < 2000 && bench.controller.program_running(); ++k) {
    bench.controller.on_egm_datagram(sensor({0, 0, 0, 0, 130, 0}, {}));
    bench.step();
  }
  EXPECT_FALSE(bench.controller.program_running());
  EXPECT_LE(deg(bench.controller.joints()[4]), 120 + 1e-6);
  EXPECT_NE(bench.last_events().find("50027"), std::string::npos);
}

TEST(Egm, ProgramStopRampsToRestAndRestartGuidesAgain) {
  Bench bench;
  bench.run_program(guided(), "G", "main");
  bench.step(20);
  for (int k = 0; k < 50; ++k) {
    bench.controller.on_egm_datagram(sensor({0.04 * k, 0, 0, 0, 90, 0}, {10, 0, 0, 0, 0, 0}));
    bench.step();
  }
  ASSERT_TRUE(bench.controller.inject("program_stop"));
  EXPECT_FALSE(bench.controller.egm_guiding());
  bench.step(150);
  const Joints rest = bench.controller.joints();
  bench.step(10);
  EXPECT_EQ(bench.controller.joints(), rest);
  EXPECT_EQ(bench.rws("POST", "/rw/rapid/execution?action=start", Bench::kStart).status, 204);
  bench.step(2);
  EXPECT_TRUE(bench.controller.egm_guiding());
}

TEST(Egm, EmergencyStopBrakesAtOnce) {
  Bench bench;
  bench.run_program(guided(), "G", "main");
  bench.step(20);
  for (int k = 0; k < 50; ++k) {
    bench.controller.on_egm_datagram(sensor({0.2 * k, 0, 0, 0, 90, 0}, {50, 0, 0, 0, 0, 0}));
    bench.step();
  }
  const double at = deg(bench.controller.joints()[0]);
  bench.controller.inject("estop", 1.0);
  bench.step(60);
  EXPECT_LT(deg(bench.controller.joints()[0]) - at, 50 * (0.15 / 2 + 0.02) + 0.5);
  const Joints rest = bench.controller.joints();
  bench.step(20);
  EXPECT_EQ(bench.controller.joints(), rest);
  EXPECT_EQ(bench.rws("POST", "/rw/panel/ctrlstate?action=setctrlstate", "ctrl-state=motoron").status, 403);
  bench.step(250);
  EXPECT_EQ(bench.rws("POST", "/rw/panel/ctrlstate?action=setctrlstate", "ctrl-state=motoron").status, 204);
}

}  // namespace weldcell::sim
