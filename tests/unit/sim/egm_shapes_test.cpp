// What public EGM clients demand of a controller's frames and replies, for each RobotWare's shape.
#include <cmath>

#include "egm_messages.hpp"
#include "fixture.hpp"

namespace weldcell::sim {
namespace {

using abb::egm::EgmRobot;
using kinematics::Joints;

constexpr const char* kGuided = R"(MODULE G
 PERS num nRuns:=0;
 VAR egmident id;
 CONST egm_minmax mm:=[-1E-09,1E-09];
 PERS tooldata tHead:=[TRUE,[[0,0,0],[1,0,0,0]],[6.5,[0,0,110],[1,0,0,0],0,0,0]];
 PROC main()
  EGMReset id;
  EGMGetId id;
  EGMSetupUC ROB_1,id,"weldcell","weldcell"\Joint\CommTimeout:=0.5;
  EGMActJoint id\Tool:=tHead\J1:=mm\J2:=mm\J3:=mm\J4:=mm\J5:=mm\J6:=mm\LpFilter:=100\SampleRate:=4\MaxSpeedDeviation:=90;
  INCR nRuns;
  EGMRunJoint id,EGM_STOP_HOLD\J1\J2\J3\J4\J5\J6\CondTime:=1E+05;
 ERROR
  RETURN;
 ENDPROC
ENDMODULE)";

/// Frames of the first cycles of guidance; the PC answers with what it is given.
std::vector<EgmRobot> frames(Bench& bench, int count) {
  std::vector<EgmRobot> out;
  for (int k = 0; k < 500 && static_cast<int>(out.size()) < count; ++k) {
    bench.controller.on_egm_datagram(sensor({0, 0, 0, 0, 90, 0}, {}));
    bench.step();
    if (const auto frame = bench.controller.egm_datagram()) out.push_back(robot(*frame));
  }
  EXPECT_EQ(static_cast<int>(out.size()), count) << bench.last_events();
  return out;
}

class EgmShapes : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(RobotWare, EgmShapes, ::testing::Values(607, 610, 700, 706, 716));

TEST_P(EgmShapes, FieldsComeWithTheirRobotWare) {
  Scene scene = test_scene();
  scene.controller.robotware = GetParam();
  scene.controller.external_axes = 2;
  Bench bench(scene);
  bench.run_program(kGuided, "G", "main");
  for (const EgmRobot& frame : frames(bench, 5)) {
    EXPECT_EQ(frame.feedback().joints().joints_size(), 6);
    EXPECT_EQ(frame.planned().joints().joints_size(), 6);
    EXPECT_EQ(frame.feedback().externaljoints().joints_size(), 2);
    EXPECT_EQ(frame.planned().externaljoints().joints_size(), 2);
    EXPECT_EQ(frame.has_utilizationrate(), GetParam() >= 610);
    EXPECT_EQ(frame.has_moveindex(), GetParam() >= 706);
    EXPECT_EQ(frame.has_collisioninfo(), GetParam() >= 706);
    EXPECT_EQ(frame.torqueref().joints_size(), GetParam() >= 716 ? 6 : 0);
    // RobotWare 6 numbers the doubles 1, where RobotWare 7 has fcActive.
    EXPECT_EQ(frame.measuredforce().has_fcactive(), GetParam() >= 700);
    EXPECT_EQ(frame.measuredforce().force_size(), GetParam() >= 700 ? 6 : 0);
    EXPECT_EQ(frame.measuredforce().unknown_fields().size(), GetParam() >= 700 ? 0U : 54U);
  }
}

TEST_P(EgmShapes, HasAllThatAClientDropsAFrameWithout) {
  Scene scene = test_scene();
  scene.controller.robotware = GetParam();
  Bench bench(scene);
  bench.run_program(kGuided, "G", "main");
  for (const EgmRobot& frame : frames(bench, 5)) {
    ASSERT_TRUE(frame.has_header() && frame.header().has_seqno() && frame.header().has_tm());
    EXPECT_EQ(frame.header().mtype(), abb::egm::EgmHeader::MSGTYPE_DATA);
    for (const abb::egm::EgmPose* pose : {&frame.feedback().cartesian(), &frame.planned().cartesian()})
      EXPECT_TRUE(pose->has_pos() && pose->has_orient());
    EXPECT_TRUE(frame.feedback().has_time() && frame.planned().has_time());
    EXPECT_TRUE(frame.has_motorstate() && frame.has_mcistate() && frame.has_rapidexecstate());
  }
}

TEST(EgmClients, QuaternionAndEulerAnglesAgree) {
  Bench bench;
  bench.run_program(kGuided, "G", "main");
  for (int k = 0; k < 100; ++k) {
    bench.controller.on_egm_datagram(
        sensor({0.3 * k, -0.1 * k, 0.1 * k, 0.5 * k, 90 - 0.2 * k, k * 1.0}, {}));
    bench.step();
  }
  const EgmRobot frame = robot(*bench.controller.egm_datagram());
  const auto& q = frame.feedback().cartesian().orient();
  const auto& e = frame.feedback().cartesian().euler();
  const Eigen::Quaterniond turned = Eigen::AngleAxisd(rad(e.z()), Eigen::Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(rad(e.y()), Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(rad(e.x()), Eigen::Vector3d::UnitX());
  EXPECT_NEAR(std::abs(turned.dot(Eigen::Quaterniond(q.u0(), q.u1(), q.u2(), q.u3()))), 1, 1e-9);
}

TEST(EgmClients, ClockAndCountGrowInMilliseconds) {
  Bench bench;
  bench.run_program(kGuided, "G", "main");
  const auto seen = frames(bench, 26);
  // A client looks twice, 100 ms apart: both have grown, the clock by no more than 200 ms.
  EXPECT_EQ(seen[25].header().seqno() - seen[0].header().seqno(), 25U);
  EXPECT_NEAR(static_cast<double>(seen[25].header().tm() - seen[0].header().tm()), 100, 1);
}

TEST(EgmClients, CountBeginsAtZeroWhenTheChannelIsSetUp) {
  for (const bool restarts : {true, false}) {
    Scene scene = test_scene();
    scene.controller.egm_seqno_restarts = restarts;
    Bench bench(scene);
    bench.run_program(kGuided, "G", "main");
    EXPECT_EQ(frames(bench, 5)[0].header().seqno(), 0U);
    ASSERT_TRUE(bench.finish(2)) << "silence ends it";
    bench.run_program(kGuided, "G", "main");
    while (bench.controller.egm_datagram()) {
    }
    const std::uint32_t first = frames(bench, 1)[0].header().seqno();
    EXPECT_EQ(first == 0, restarts) << first;
  }
}

TEST(EgmClients, RapidMayStayUndefinedAfterARestart) {
  Scene scene = test_scene();
  scene.controller.rapid_state_lost = true;
  Bench bench(scene);
  bench.run_program(kGuided, "G", "main");
  EXPECT_EQ(frames(bench, 1)[0].rapidexecstate().state(), abb::egm::EgmRapidCtrlExecState::RAPID_RUNNING);
  bench.controller.inject("restart", 0.1);
  bench.step(50);
  bench.run_program(kGuided, "G", "main");
  EXPECT_EQ(frames(bench, 1)[0].rapidexecstate().state(), abb::egm::EgmRapidCtrlExecState::RAPID_UNDEFINED);
}

/// What one public client or another answers, all towards joint 1 = 0.5 deg.
struct Reply {
  const char* client;
  void (*shape)(abb::egm::EgmSensor&);
};

TEST(EgmClients, RepliesOfEveryClientAreObeyed) {
  const Reply replies[] = {
      {"clock left out", [](abb::egm::EgmSensor& m) { m.mutable_header()->clear_tm(); }},
      {"clock always zero", [](abb::egm::EgmSensor& m) { m.mutable_header()->set_tm(0); }},
      {"count by two", [](abb::egm::EgmSensor& m) { m.mutable_header()->set_seqno(2 * m.header().seqno()); }},
      {"joints with pose, quaternion and Euler angles",
       [](abb::egm::EgmSensor& m) {
         auto* pose = m.mutable_planned()->mutable_cartesian();
         pose->mutable_pos()->set_x(1), pose->mutable_pos()->set_y(2), pose->mutable_pos()->set_z(3);
         auto* q = pose->mutable_orient();
         q->set_u0(1), q->set_u1(0), q->set_u2(0), q->set_u3(0);
         auto* e = pose->mutable_euler();
         e->set_x(10), e->set_y(20), e->set_z(30);
       }},
      {"without speed references", [](abb::egm::EgmSensor& m) { m.clear_speedref(); }},
      {"with external axes", [](abb::egm::EgmSensor& m) {
         m.mutable_planned()->mutable_externaljoints()->add_joints(5);
         m.mutable_speedref()->mutable_externaljoints()->add_joints(0);
       }}};
  for (const Reply& reply : replies) {
    Bench bench;
    bench.run_program(kGuided, "G", "main");
    bench.step(20);
    for (std::uint32_t k = 0; k < 200; ++k) {
      abb::egm::EgmSensor message;
      message.mutable_header()->set_seqno(k);
      message.mutable_header()->set_tm(4 * k);
      message.mutable_header()->set_mtype(abb::egm::EgmHeader::MSGTYPE_CORRECTION);
      for (int i = 0; i < 6; ++i) {
        message.mutable_planned()->mutable_joints()->add_joints(i == 4 ? 90 : i == 0 ? 0.5 : 0);
        message.mutable_speedref()->mutable_joints()->add_joints(0);
      }
      reply.shape(message);
      const std::string raw = message.SerializeAsString();
      bench.controller.on_egm_datagram(std::as_bytes(std::span(raw)));
      bench.step();
    }
    EXPECT_EQ(bench.controller.malformed_egm_datagrams(), 0U) << reply.client;
    EXPECT_NEAR(deg(bench.controller.joints()[0]), 0.5, 1e-3) << reply.client;
  }
}

TEST(EgmClients, OneDatagramACycleIsReadSoThatASenderInHasteBuildsUpLag) {
  Bench bench;
  bench.run_program(kGuided, "G", "main");
  bench.step(20);
  for (int k = 0; k < 40; ++k) bench.controller.on_egm_datagram(sensor({0, 0, 0, 0, 90, 0}, {}));
  bench.controller.on_egm_datagram(sensor({1, 0, 0, 0, 90, 0}, {}));
  bench.step(40 + 3);
  EXPECT_NEAR(deg(bench.controller.joints()[0]), 0, 1e-9) << "forty older ones come first";
  bench.step(60);
  EXPECT_GT(deg(bench.controller.joints()[0]), 0.9);
}

TEST(EgmClients, SetupNamesRowsOfTheConfiguration) {
  for (const char* name : {"\"weldcell\",\"none\"", "\"none\",\"weldcell\""}) {
    std::string text = kGuided;
    text.replace(text.find("\"weldcell\",\"weldcell\""), 21, name);
    // Without its error handler the program stops where it stands.
    text.erase(text.find(" ERROR"), std::string(" ERROR\n  RETURN;\n").size());
    Bench bench;
    bench.run_program(text, "G", "main");
    ASSERT_TRUE(bench.finish(1));
    EXPECT_NE(bench.last_events().find("EGMSetupUC: no external motion data"), std::string::npos);
  }
}

}  // namespace
}  // namespace weldcell::sim
