// Utilization, motion control's state and convergence: counted while a motion is followed, told once.
#include "weldcell/app/egm_watch.hpp"

#include <gmock/gmock.h>

#include "egm.pb.h"

namespace weldcell::app {
namespace {

using ::testing::HasSubstr;

/// One cycle: the controller's frame, and what the session made of it.
struct Frame {
  double utilization = 40;
  bool converged = false;
  int mci = 3;
  robot::EgmReport report;

  job::EgmCycle cycle() const {
    abb::egm::EgmRobot m;
    m.mutable_header()->set_seqno(1);
    m.mutable_header()->set_tm(4);
    m.mutable_header()->set_mtype(abb::egm::EgmHeader::MSGTYPE_DATA);
    for (int i = 0; i < 6; ++i) m.mutable_feedback()->mutable_joints()->add_joints(0);
    m.mutable_motorstate()->set_state(abb::egm::EgmMotorState::MOTORS_ON);
    m.mutable_mcistate()->set_state(static_cast<abb::egm::EgmMCIState::MCIStateType>(mci));
    m.mutable_rapidexecstate()->set_state(abb::egm::EgmRapidCtrlExecState::RAPID_RUNNING);
    m.set_mciconvergencemet(converged);
    m.set_utilizationrate(utilization);
    const std::string raw = m.SerializeAsString();
    job::EgmCycle out;
    for (const char c : raw) out.datagram.push_back(static_cast<std::byte>(c));
    out.report = report;
    return out;
  }
};

robot::EgmReport following(std::uint64_t plan) {
  robot::EgmReport out;
  out.phase = robot::EgmPhase::Following;
  out.plan_id = plan;
  out.session = 1;
  return out;
}

TEST(EgmWatch, ShowsTheLastFrameAndThePeakOfTheMotion) {
  EgmWatch watch;
  Frame frame;
  frame.utilization = 180;
  watch.on(frame.cycle());
  EXPECT_EQ(watch.figures().utilization_percent, 180);
  EXPECT_EQ(watch.figures().peak_percent, 0) << "nothing is followed yet";
  EXPECT_TRUE(watch.take_warnings().empty());
  frame.report = following(1);
  frame.utilization = 95;
  watch.on(frame.cycle());
  frame.utilization = 60;
  watch.on(frame.cycle());
  EXPECT_EQ(watch.figures().utilization_percent, 60);
  EXPECT_EQ(watch.figures().peak_percent, 95);
  EXPECT_EQ(watch.figures().overloaded, 0U);
  EXPECT_EQ(watch.figures().frames, 3U);
  EXPECT_EQ(watch.figures().motors, wire::MotorState::On);
  EXPECT_EQ(watch.figures().mci, wire::MciState::Running);
  EXPECT_EQ(watch.figures().rapid, wire::RapidState::Running);
  EXPECT_TRUE(watch.take_warnings().empty());
}

TEST(EgmWatch, OverloadIsCountedAndToldOnceAMotion) {
  EgmWatch watch;
  Frame frame;
  frame.utilization = 130;
  for (const std::uint64_t plan : {1, 2}) {
    frame.report = following(plan);
    for (int k = 0; k < 10; ++k) watch.on(frame.cycle());
    const auto told = watch.take_warnings();
    ASSERT_EQ(told.size(), 1U);
    EXPECT_THAT(told[0], HasSubstr("utilization 130 %"));
    EXPECT_THAT(told[0], HasSubstr("inspection.speed_mm_s"));
  }
  EXPECT_EQ(watch.figures().overloaded, 20U);
}

TEST(EgmWatch, ConvergenceInAMotionAndErrorsAreTold) {
  EgmWatch watch;
  Frame frame;
  frame.converged = true;
  watch.on(frame.cycle());
  EXPECT_TRUE(watch.take_warnings().empty()) << "at rest it means nothing";
  frame.report = following(1);
  watch.on(frame.cycle());
  EXPECT_THAT(watch.take_warnings(), ::testing::ElementsAre(HasSubstr("convergence")));
  frame.converged = false;
  frame.mci = 1;
  for (int k = 0; k < 5; ++k) watch.on(frame.cycle());
  EXPECT_THAT(watch.take_warnings(), ::testing::ElementsAre(HasSubstr("41822")));
  frame.report.session = 2;
  watch.on(frame.cycle());
  EXPECT_EQ(watch.take_warnings().size(), 1U) << "another session";
}

TEST(EgmWatch, CountsWhatTheSessionCountedSinceTheBegin) {
  EgmWatch watch;
  Frame frame;
  frame.report.limited = 7, frame.report.stale = 3, frame.report.malformed = 1;
  watch.on(frame.cycle());
  EXPECT_EQ(watch.figures().limited, 0U) << "of a job before";
  frame.report.limited = 9, frame.report.stale = 4;
  job::EgmCycle broken = frame.cycle();
  frame.report.malformed = 2;
  broken.report = frame.report;
  broken.datagram.resize(5);
  watch.on(broken);
  EXPECT_EQ(watch.figures().limited, 2U);
  EXPECT_EQ(watch.figures().stale, 1U);
  EXPECT_EQ(watch.figures().malformed, 1U);
  EXPECT_EQ(watch.figures().frames, 1U);
}

}  // namespace
}  // namespace weldcell::app
