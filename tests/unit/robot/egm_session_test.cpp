#include <limits>

#include "unit/robot/egm_session_fixture.hpp"

namespace weldcell::robot {
namespace {

TEST_F(EgmSessionTest, FirstReplyIsWhereTheRobotIs) {
  EgmSession fresh(small_cell());
  Frames other(fresh);
  other.joints = {1, 2, 3, 4, 5, 6};
  const auto reply = other.send();
  ASSERT_TRUE(reply);
  EXPECT_TRUE(reply->correction);
  EXPECT_EQ(reply->seqno, 0U);
  EXPECT_EQ(reply->joints, other.joints);
  EXPECT_EQ(reply->speed, Axes{});
  EXPECT_EQ(fresh.report().session, 1U);
  EXPECT_EQ(fresh.report().phase, EgmPhase::Holding);
}

TEST_F(EgmSessionTest, OneReplyAFrameWithItsOwnCount) {
  for (std::uint32_t k = 1; k < 20; ++k) EXPECT_EQ(frames.next().seqno, k);
  EXPECT_EQ(session.report().session, 1U);
}

TEST_F(EgmSessionTest, HoldsItsReferenceWhileTheArmSags) {
  frames.pass(4);
  frames.joints[1] += 0.01;
  const auto reply = frames.send();
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->joints, kStart);
}

TEST_F(EgmSessionTest, WaitsAtTheMeasuredJointsUntilTheControllerRuns) {
  EgmSession fresh(small_cell());
  Frames other(fresh);
  other.mci = wire::MciState::Stopped;
  other.send();
  EXPECT_EQ(fresh.report().phase, EgmPhase::Waiting);
  other.pass(4);
  other.joints[0] = 55;
  auto reply = other.send();
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->joints, other.joints);
  other.mci = wire::MciState::Running;
  other.rapid = wire::RapidState::Undefined;
  other.next();
  EXPECT_EQ(fresh.report().phase, EgmPhase::Holding) << "RAPID UNDEFINED counts as running";
}

TEST_F(EgmSessionTest, MalformedDatagramsGetNoAnswerAndChangeNothing) {
  std::array<std::byte, 512> out{};
  const std::vector<std::byte> noise(100, std::byte{0xEE});
  EXPECT_EQ(session.on_datagram(noise, frames.now, out), 0U);
  EXPECT_EQ(session.on_datagram({}, frames.now, out), 0U);
  frames.pass(4);
  frames.joints[2] = std::nan("");
  EXPECT_FALSE(frames.send());
  EXPECT_EQ(session.report().malformed, 3U);
  frames.joints = kStart;
  EXPECT_EQ(frames.next().joints, kStart);
}

TEST_F(EgmSessionTest, DuplicateAndLateFramesGetNoAnswer) {
  frames.next();
  EXPECT_FALSE(frames.send());
  const auto seqno = frames.seqno, tm = frames.tm;
  frames.next();
  frames.next();
  frames.seqno = seqno;
  frames.tm = tm;
  EXPECT_FALSE(frames.send());
  EXPECT_EQ(session.report().stale, 2U);
  EXPECT_EQ(session.report().session, 1U);
}

TEST_F(EgmSessionTest, CountsWrapWithoutANewSession) {
  EgmSession fresh(small_cell());
  Frames other(fresh);
  other.seqno = std::numeric_limits<std::uint32_t>::max() - 1;
  other.tm = std::numeric_limits<std::uint32_t>::max() - 6;
  other.send();
  for (int k = 0; k < 5; ++k) other.next();
  EXPECT_EQ(fresh.report().session, 1U);
  EXPECT_EQ(fresh.report().stale, 0U);
}

TEST_F(EgmSessionTest, SessionBeginsAnewBySeqnoByClockAndBySilence) {
  for (int k = 0; k < 300; ++k) frames.next();
  frames.pass(4);
  frames.seqno = 0;  // the channel was set up again
  frames.joints[0] = 12;
  auto reply = frames.send();
  ASSERT_TRUE(reply);
  EXPECT_EQ(session.report().session, 2U);
  EXPECT_EQ(reply->seqno, 0U);
  EXPECT_EQ(reply->joints[0], 12);

  frames.pass(4);
  frames.tm = 100;  // the controller was started again, its count went on
  frames.joints[0] = 14;
  reply = frames.send();
  ASSERT_TRUE(reply);
  EXPECT_EQ(session.report().session, 3U);
  EXPECT_EQ(reply->joints[0], 14);

  frames.next();
  frames.pass(501, 125);
  frames.joints[0] = 16;
  reply = frames.send();
  ASSERT_TRUE(reply);
  EXPECT_EQ(session.report().session, 4U);
  EXPECT_EQ(reply->joints[0], 16);

  frames.pass(499, 125);
  frames.joints[0] = 18;
  reply = frames.send();
  ASSERT_TRUE(reply);
  EXPECT_EQ(session.report().session, 4U);
  EXPECT_EQ(reply->joints[0], 16) << "the reference is held within a session";
}

TEST_F(EgmSessionTest, BothCountsFarBackAreANewSession) {
  for (int k = 0; k < 1000; ++k) frames.next();
  frames.seqno = 0;
  frames.tm = 10;
  frames.now = frames.now + 4'000'000;
  EXPECT_TRUE(frames.send());
  EXPECT_EQ(session.report().session, 2U);
}

}  // namespace
}  // namespace weldcell::robot
