// Pose guidance as public clients use it: position with quaternion, Euler angles, or both.
#include <cmath>

#include "egm_messages.hpp"
#include "fixture.hpp"

namespace weldcell::sim {
namespace {

/// The home posture has the flange at (945, 0, 1375), looking straight down.
constexpr const char* kPose = R"(MODULE G
 VAR egmident id;
 CONST egm_minmax mmPos:=[-0.2,0.2];
 CONST egm_minmax mmRot:=[-0.2,0.2];
 CONST pose peZero:=[[0,0,0],[1,0,0,0]];
 PERS num nState:=0;
 PERS tooldata tHead:=[TRUE,[[0,0,100],[1,0,0,0]],[6.5,[0,0,110],[1,0,0,0],0,0,0]];
 PROC main()
  EGMReset id;
  EGMGetId id;
  EGMSetupUC ROB_1,id,"default","ROB_1"\Pose;
  EGMActPose id\Tool:=tHead,peZero,EGM_FRAME_BASE,peZero,EGM_FRAME_BASE\x:=mmPos\y:=mmPos\z:=mmPos\rx:=mmRot\ry:=mmRot\rz:=mmRot\LpFilter:=100\SampleRate:=4\MaxSpeedDeviation:=90;
  nState:=3;
  EGMRunPose id,EGM_STOP_HOLD\x\y\z\rx\ry\rz\CondTime:=1;
  EGMReset id;
  nState:=4;
 ENDPROC
ENDMODULE)";

struct Wanted {
  Eigen::Vector3d at{945, 0, 1275};
  bool quaternion = false, euler = false;
  Eigen::Quaterniond q{0, 0, 1, 0};
  Eigen::Vector3d euler_deg{180, 0, 180};
};

std::vector<std::byte> pose(const Wanted& w) {
  abb::egm::EgmSensor m;
  m.mutable_header()->set_seqno(1);
  m.mutable_header()->set_mtype(abb::egm::EgmHeader::MSGTYPE_CORRECTION);
  // Joints ride along, as one client has it, and must be ignored.
  for (int i = 0; i < 6; ++i) m.mutable_planned()->mutable_joints()->add_joints(33);
  auto* p = m.mutable_planned()->mutable_cartesian();
  p->mutable_pos()->set_x(w.at.x()), p->mutable_pos()->set_y(w.at.y()), p->mutable_pos()->set_z(w.at.z());
  if (w.quaternion) {
    auto* q = p->mutable_orient();
    q->set_u0(w.q.w()), q->set_u1(w.q.x()), q->set_u2(w.q.y()), q->set_u3(w.q.z());
  }
  if (w.euler) {
    auto* e = p->mutable_euler();
    e->set_x(w.euler_deg.x()), e->set_y(w.euler_deg.y()), e->set_z(w.euler_deg.z());
  }
  const std::string raw = m.SerializeAsString();
  const auto bytes = std::as_bytes(std::span(raw));
  return {bytes.begin(), bytes.end()};
}

/// Where the tool is after the PC asked for the pose for a second.
Eigen::Isometry3d after(Bench& bench, const Wanted& wanted) {
  for (int k = 0; k < 225; ++k) {
    bench.controller.on_egm_datagram(pose(wanted));
    bench.step();
  }
  return kinematics::forward(test_arm(), bench.controller.joints()).iso * Eigen::Translation3d(0, 0, 100);
}

double turned_deg(const Eigen::Isometry3d& at, const Eigen::Quaterniond& wanted) {
  return deg(Eigen::Quaterniond(at.linear()).angularDistance(wanted));
}

TEST(EgmPose, QuaternionAndEulerAnglesLeadToTheSamePose) {
  const Eigen::Quaterniond tilted = Eigen::AngleAxisd(rad(190), Eigen::Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(rad(5), Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(rad(175), Eigen::Vector3d::UnitX());
  for (const bool euler : {false, true}) {
    Bench bench;
    bench.run_program(kPose, "G", "main");
    Wanted wanted;
    wanted.at = {960, 20, 1260};
    wanted.quaternion = !euler;
    wanted.euler = euler;
    wanted.q = tilted;
    wanted.euler_deg = {175, 5, 190};
    const Eigen::Isometry3d at = after(bench, wanted);
    EXPECT_LT((at.translation() - wanted.at).norm(), 0.5) << (euler ? "Euler" : "quaternion");
    EXPECT_LT(turned_deg(at, tilted), 0.1) << (euler ? "Euler" : "quaternion");
  }
}

TEST(EgmPose, EulerAnglesWinOverAQuaternion) {
  Bench bench;
  bench.run_program(kPose, "G", "main");
  Wanted wanted;
  wanted.quaternion = wanted.euler = true;
  wanted.q = Eigen::Quaterniond(Eigen::AngleAxisd(rad(20), Eigen::Vector3d::UnitY())) * wanted.q;
  wanted.euler_deg = {180, 0, 195};
  const Eigen::Quaterniond by_euler = Eigen::AngleAxisd(rad(195), Eigen::Vector3d::UnitZ()) *
                                      Eigen::AngleAxisd(rad(180), Eigen::Vector3d::UnitX());
  const Eigen::Isometry3d at = after(bench, wanted);
  EXPECT_LT(turned_deg(at, by_euler), 0.1);
  EXPECT_GT(turned_deg(at, wanted.q), 10);
}

TEST(EgmPose, ConvergenceEndsItAndAnUnreachablePoseStopsIt) {
  Bench bench;
  bench.run_program(kPose, "G", "main");
  Wanted wanted;
  wanted.quaternion = true;
  wanted.at.x() = 950;
  for (int k = 0; k < 1000 && bench.controller.program_running(); ++k) {
    bench.controller.on_egm_datagram(pose(wanted));
    bench.step();
  }
  EXPECT_EQ(bench.value("G", "nState"), "4");
  Bench far;
  far.run_program(kPose, "G", "main");
  far.step(20);
  wanted.at.x() = 5000;
  far.controller.on_egm_datagram(pose(wanted));
  far.step(5);
  EXPECT_FALSE(far.controller.program_running());
  EXPECT_NE(far.last_events().find("50027"), std::string::npos);
}

TEST(EgmPose, IncompletePosesAreRefusedAndModesAreNotMixed) {
  Bench bench;
  bench.run_program(kPose, "G", "main");
  bench.step(20);
  Wanted wanted;  // no orientation
  bench.controller.on_egm_datagram(pose(wanted));
  bench.step();
  wanted.quaternion = true;
  wanted.q = {0, 0, 0, 0};
  bench.controller.on_egm_datagram(pose(wanted));
  bench.step();
  bench.controller.on_egm_datagram(sensor({0, 0, 0, 0, 90, 0}, {}));
  bench.step();
  EXPECT_EQ(bench.controller.malformed_egm_datagrams(), 3U);
  std::string text = kPose;
  const std::string run = "EGMRunPose id,EGM_STOP_HOLD\\x\\y\\z\\rx\\ry\\rz";
  text.replace(text.find(run), run.size(), "EGMRunJoint id,EGM_STOP_HOLD\\J1\\J2\\J3\\J4\\J5\\J6");
  Bench mixed;
  mixed.run_program(text, "G", "main");
  ASSERT_TRUE(mixed.finish(1));
  EXPECT_NE(mixed.last_events().find("41826"), std::string::npos);
}

}  // namespace
}  // namespace weldcell::sim
