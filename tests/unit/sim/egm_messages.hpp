// EGM messages of both sides for the simulator's tests.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <vector>

#include "egm.pb.h"
#include "weldcell/kinematics/arm_model.hpp"

namespace weldcell::sim {

/// What a PC answers in joint mode, degrees and deg/s.
inline std::vector<std::byte> sensor(const kinematics::Joints& joints_deg,
                                     const kinematics::Joints& speed_deg_s, bool with_position = true) {
  abb::egm::EgmSensor message;
  message.mutable_header()->set_seqno(1);
  message.mutable_header()->set_tm(1);
  message.mutable_header()->set_mtype(abb::egm::EgmHeader::MSGTYPE_CORRECTION);
  for (std::size_t i = 0; i < 6; ++i) {
    if (with_position) message.mutable_planned()->mutable_joints()->add_joints(joints_deg[i]);
    message.mutable_speedref()->mutable_joints()->add_joints(speed_deg_s[i]);
  }
  std::vector<std::byte> out(message.ByteSizeLong());
  message.SerializeToArray(out.data(), static_cast<int>(out.size()));
  return out;
}

inline abb::egm::EgmRobot robot(const std::vector<std::byte>& bytes) {
  abb::egm::EgmRobot out;
  EXPECT_TRUE(out.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())));
  return out;
}

}  // namespace weldcell::sim
