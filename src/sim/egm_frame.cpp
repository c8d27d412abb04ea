// The EgmRobot frame of the simulated controller, in the shape of each RobotWare.
#include <cmath>
#include <cstring>

#include "egm.pb.h"
#include "sim/egm_channel.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::sim {

using kinematics::Joints;

namespace {

void put_joints(const Joints& joints, abb::egm::EgmJoints* out) {
  for (const double joint : joints) out->add_joints(deg(joint));
}

/// External axes stand still: 100, 200, ... mm or deg.
void put_externals(int count, abb::egm::EgmJoints* out) {
  for (int i = 1; i <= count; ++i) out->add_joints(100.0 * i);
}

void put_pose(const Eigen::Isometry3d& pose, abb::egm::EgmPose* out) {
  const Eigen::Vector3d p = pose.translation();
  out->mutable_pos()->set_x(p.x());
  out->mutable_pos()->set_y(p.y());
  out->mutable_pos()->set_z(p.z());
  const Eigen::Matrix3d r = pose.linear();
  const Eigen::Quaterniond q(r);
  out->mutable_orient()->set_u0(q.w());
  out->mutable_orient()->set_u1(q.x());
  out->mutable_orient()->set_u2(q.y());
  out->mutable_orient()->set_u3(q.z());
  out->mutable_euler()->set_x(deg(std::atan2(r(2, 1), r(2, 2))));
  out->mutable_euler()->set_y(deg(std::atan2(-r(2, 0), std::hypot(r(2, 1), r(2, 2)))));
  out->mutable_euler()->set_z(deg(std::atan2(r(1, 0), r(0, 0))));
}

void put_clock(std::int64_t us, abb::egm::EgmClock* out) {
  out->set_sec(static_cast<std::uint64_t>(us / 1'000'000));
  out->set_usec(static_cast<std::uint64_t>(us % 1'000'000));
}

/// No force control: zeros. RobotWare 6 has the doubles in field 1, where RobotWare 7 has a bool.
void put_force(int robotware, abb::egm::EgmMeasuredForce* out) {
  constexpr int kComponents = 6;
  if (robotware >= 700) {
    out->set_fcactive(false);
    for (int i = 0; i < kComponents; ++i) out->add_force(0);
    return;
  }
  constexpr char kFieldOneDouble = (1 << 3) | 1;
  for (int i = 0; i < kComponents; ++i) {
    out->mutable_unknown_fields()->push_back(kFieldOneDouble);
    out->mutable_unknown_fields()->append(sizeof(double), '\0');
  }
}

}  // namespace

std::vector<std::byte> EgmChannel::frame(const EgmFrame& now) {
  abb::egm::EgmRobot message;
  message.mutable_header()->set_seqno(seqno_++);
  message.mutable_header()->set_tm(now.tm_ms);
  message.mutable_header()->set_mtype(abb::egm::EgmHeader::MSGTYPE_DATA);
  const auto tcp = [&](const Joints& joints) {
    return activation_.wobj.inverse() * kinematics::forward(arm_, joints).iso * activation_.tool;
  };
  const auto put_state = [&](const Joints& joints, std::int64_t time_us, auto* out) {
    put_joints(joints, out->mutable_joints());
    put_pose(tcp(joints), out->mutable_cartesian());
    if (shape_.external_axes > 0) put_externals(shape_.external_axes, out->mutable_externaljoints());
    put_clock(time_us, out->mutable_time());
  };
  put_state(now.measured, now.feedback_us, message.mutable_feedback());
  put_state(now.planned, now.planned_us, message.mutable_planned());
  message.mutable_motorstate()->set_state(now.motors_on ? abb::egm::EgmMotorState::MOTORS_ON
                                                        : abb::egm::EgmMotorState::MOTORS_OFF);
  message.mutable_mcistate()->set_state(static_cast<abb::egm::EgmMCIState::MCIStateType>(mci_));
  message.set_mciconvergencemet(convergence_met_);
  message.mutable_testsignals();
  using Rapid = abb::egm::EgmRapidCtrlExecState;
  message.mutable_rapidexecstate()->set_state(now.rapid_unknown   ? Rapid::RAPID_UNDEFINED
                                              : now.rapid_running ? Rapid::RAPID_RUNNING
                                                                  : Rapid::RAPID_STOPPED);
  put_force(shape_.robotware, message.mutable_measuredforce());
  if (shape_.robotware >= 610) message.set_utilizationrate(utilization_);
  if (shape_.robotware >= 706) {
    message.set_moveindex(moves_);
    message.mutable_collisioninfo()->set_collsiontriggered(false);
  }
  if (shape_.robotware >= 716) {
    for (std::size_t i = 0; i < 6; ++i) message.mutable_torqueref()->add_joints(0);
  }
  std::vector<std::byte> out(message.ByteSizeLong());
  message.SerializeToArray(out.data(), static_cast<int>(out.size()));
  return out;
}

}  // namespace weldcell::sim
