// A script of frames, gaps, stops and offers against an EGM session: whatever comes, every reference is
// finite, and within a motion no two differ by more than the speed limit allows.
#include <cmath>

#include "egm.pb.h"
#include "fuzz_target.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/robot/egm_session.hpp"

using namespace weldcell;

namespace {

cell::CellSetup small_cell() {
  cell::CellSetup cell;
  for (std::size_t i = 0; i < 6; ++i) {
    cell.arm.lower[i] = rad(-170);
    cell.arm.upper[i] = rad(170);
    cell.arm.max_speed[i] = rad(200);
    cell.limits.joint_acceleration[i] = rad(400);
    cell.limits.joint_jerk[i] = rad(4000);
  }
  return cell;
}

plan::MotionPlan wave(double way_deg, double duration_s) {
  plan::MotionPlan plan;
  plan.id = 1;
  const int count = static_cast<int>(duration_s / plan.period_s);
  for (int k = 0; k <= count; ++k) {
    const double u = static_cast<double>(k) / count, w = 2 * kPi;
    plan::MotionSample sample;
    sample.q[0] = rad(way_deg * (u - std::sin(w * u) / w));
    sample.qd[0] = rad(way_deg * (1 - std::cos(w * u)) / duration_s);
    plan.samples.push_back(sample);
  }
  return plan;
}

struct Controller {
  std::uint32_t seqno = 0, tm = 1000;
  std::int64_t time_us = 990'000;
  HostTime now{kSecond};
  double joint_deg = 0;
  bool motors = true, running = true;

  std::string frame() const {
    abb::egm::EgmRobot robot;
    robot.mutable_header()->set_seqno(seqno);
    robot.mutable_header()->set_tm(tm);
    robot.mutable_header()->set_mtype(abb::egm::EgmHeader::MSGTYPE_DATA);
    for (int i = 0; i < 6; ++i)
      robot.mutable_feedback()->mutable_joints()->add_joints(i == 0 ? joint_deg : 0);
    robot.mutable_feedback()->mutable_time()->set_sec(static_cast<std::uint64_t>(time_us / 1'000'000));
    robot.mutable_feedback()->mutable_time()->set_usec(static_cast<std::uint64_t>(time_us % 1'000'000));
    robot.mutable_motorstate()->set_state(motors ? abb::egm::EgmMotorState::MOTORS_ON
                                                 : abb::egm::EgmMotorState::MOTORS_OFF);
    robot.mutable_mcistate()->set_state(running ? abb::egm::EgmMCIState::MCI_RUNNING
                                                : abb::egm::EgmMCIState::MCI_STOPPED);
    return robot.SerializeAsString();
  }
  void pass(int ms) {
    ++seqno;
    tm += static_cast<std::uint32_t>(ms);
    time_us += ms * 1000;
    now = now + ms * kMillisecond;
  }
};

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const plan::MotionPlan gentle = wave(30, 1), fierce = wave(300, 0.4);
  robot::EgmSession session{small_cell()};
  Controller controller;
  session.set_armed(true);
  std::array<std::byte, 512> reply{};
  double last_deg = 0;
  for (std::size_t i = 0; i < size; ++i) {
    int ms = 4;
    switch (data[i] & 0x0F) {
      case 0:
        session.offer(&gentle);
        break;
      case 1:
        session.offer(&fierce);
        break;
      case 2:
        session.request_stop();
        break;
      case 3:
        session.set_armed((data[i] & 0x10) != 0);
        break;
      case 4:
        controller.motors = (data[i] & 0x10) != 0;
        break;
      case 5:
        controller.running = (data[i] & 0x10) != 0;
        break;
      case 6:
        controller.seqno = 0;
        break;
      case 7:
        controller.tm -= data[i];
        break;
      case 8:
        controller.time_us -= data[i] * 100;
        break;
      case 9:
        ms = data[i];
        break;
      case 10:
        ms = data[i] * 4;
        break;
      case 11:
        session.on_datagram(fuzz::bytes(data + i, size - i), controller.now, reply);
        break;
      default:
        break;
    }
    for (int k = 0; k < 1 + (data[i] >> 4); ++k) {
      controller.pass(k == 0 ? ms : 4);
      const std::string raw = controller.frame();
      const std::size_t n = session.on_datagram(std::as_bytes(std::span(raw)), controller.now, reply);
      if (n == 0) continue;
      abb::egm::EgmSensor sensor;
      WELDCELL_ASSERT(sensor.ParseFromArray(reply.data(), static_cast<int>(n)));
      const double reference = sensor.planned().joints().joints(0);
      WELDCELL_ASSERT(std::isfinite(reference) && std::isfinite(sensor.speedref().joints().joints(0)));
      WELDCELL_ASSERT(std::abs(reference - last_deg) <= 102.0 * 0.1 + 1e-6);
      WELDCELL_ASSERT(std::abs(reference) <= 169.0 + 1e-6);
      last_deg = controller.joint_deg = reference;
    }
  }
  return 0;
}
