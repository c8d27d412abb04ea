#include "sim/egm_channel.hpp"

#include <algorithm>
#include <cmath>

#include "egm.pb.h"
#include "weldcell/base/units.hpp"

namespace weldcell::sim {

using kinematics::Joints;

namespace {
constexpr std::size_t kQueueLimit = 128;  // what a socket buffer would hold of them
constexpr std::size_t kMaxDatagram = 1400;
constexpr double kEncoderStep_rad = 2e-6;  // a convergence band narrower than this never holds
}  // namespace

EgmChannel::EgmChannel(const kinematics::ArmModel& arm, double position_gain, double low_pass_hz,
                       double cycle_s, EgmShape shape)
    : arm_(arm), gain_(position_gain), low_pass_hz_(low_pass_hz), cycle_s_(cycle_s), shape_(shape) {}

void EgmChannel::reset() {
  state_ = EgmState::Disconnected;
  mci_ = MciReport::Undefined;
  activated_ = sending_ = false;
  queue_.clear();
}

void EgmChannel::get_id() {
  state_ = EgmState::Connected;
  mci_ = MciReport::Stopped;
}

void EgmChannel::set_up(double comm_timeout_s) {
  comm_timeout_s_ = comm_timeout_s;
  if (shape_.seqno_restarts) seqno_ = 0;
  activated_ = false;
  sending_ = false;
  queue_.clear();
}

bool EgmChannel::activate(const EgmActivation& activation) {
  if (state_ != EgmState::Connected) return false;
  activation_ = activation;
  if (activation_.low_pass_hz <= 0) activation_.low_pass_hz = low_pass_hz_;
  activated_ = true;
  sending_ = activation.stream;
  mci_ = MciReport::Stopped;
  return true;
}

bool EgmChannel::run(const EgmRun& run, const Joints& at) {
  if (state_ != EgmState::Connected || !activated_) return false;
  run_ = run;
  state_ = EgmState::Running;
  ++moves_;
  mci_ = MciReport::Running;
  sending_ = true;
  start_ = reference_ = at;
  speed_reference_ = filtered_ = {};
  pose_target_ = kinematics::forward(arm_, at).iso * activation_.tool;
  age_s_ = running_s_ = converged_s_ = utilization_ = 0;
  convergence_met_ = out_of_range_ = false;
  position_given_ = true;
  cycle_count_ = 0;
  queue_.clear();
  return true;
}

void EgmChannel::end() {
  if (state_ != EgmState::Running) return;
  state_ = EgmState::Connected;
  if (mci_ == MciReport::Running) mci_ = MciReport::Stopped;
  sending_ = activation_.stream;
}

void EgmChannel::on_datagram(std::span<const std::byte> datagram) {
  if (!sending_) return;
  if (queue_.size() < kQueueLimit) queue_.emplace_back(datagram.begin(), datagram.end());
}

bool EgmChannel::refuse(const char* why) {
  ++malformed_;
  complaint_ = why;
  return false;
}

bool EgmChannel::read(std::span<const std::byte> datagram) {
  abb::egm::EgmSensor message;
  if (datagram.empty() || datagram.size() > kMaxDatagram) return refuse("wrong size");
  if (!message.ParseFromArray(datagram.data(), static_cast<int>(datagram.size())))
    return refuse("not a protobuf message");
  if (!message.has_header()) return refuse("no header");
  if (message.header().mtype() != abb::egm::EgmHeader::MSGTYPE_CORRECTION)
    return refuse("message type is not CORRECTION");
  // Clients send joints and pose in one message: the one that is not guided by is ignored.
  return activation_.pose ? take_pose(message) : take_joints(message);
}

bool EgmChannel::take_joints(const abb::egm::EgmSensor& message) {
  const bool position = message.has_planned() && message.planned().has_joints();
  const bool speed = message.has_speedref() && message.speedref().has_joints();
  if (!position && !speed) return refuse("neither joints nor joint speeds");
  if (position && message.planned().joints().joints_size() != 6) return refuse("not six joints");
  if (speed && message.speedref().joints().joints_size() != 6) return refuse("not six joint speeds");
  for (int i = 0; i < 6; ++i) {
    if (position && !std::isfinite(message.planned().joints().joints(i)))
      return refuse("a joint is not finite");
    if (speed && !std::isfinite(message.speedref().joints().joints(i)))
      return refuse("a joint speed is not finite");
  }
  position_given_ = position;
  for (int i = 0; i < 6; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (position) reference_[k] = rad(message.planned().joints().joints(i));
    speed_reference_[k] = speed ? rad(message.speedref().joints().joints(i)) : 0;
  }
  return true;
}

std::string EgmChannel::take_complaint() {
  if (malformed_ == complained_) return {};
  const std::string out =
      complaint_ + " (" + std::to_string(malformed_ - complained_) + " since the last report)";
  complained_ = malformed_;
  return out;
}

EgmChannel::Outcome EgmChannel::step(Joints& position, Joints& speed) {
  age_s_ += cycle_s_;
  // One message a cycle is taken, however many wait: a peer that sends faster builds up lag.
  if (!queue_.empty()) {
    if (read(queue_.front())) age_s_ = 0;
    queue_.pop_front();
  }
  if (!guiding()) return Outcome::None;
  running_s_ += cycle_s_;
  if (age_s_ > comm_timeout_s_ + 1e-9) {
    mci_ = MciReport::Error;
    return Outcome::TimedOut;
  }
  control(position, speed);
  if (out_of_range_) {
    mci_ = MciReport::Error;
    return Outcome::OutOfRange;
  }
  convergence_met_ = activation_.pose ? pose_converged(position) : converged(position);
  converged_s_ = convergence_met_ ? converged_s_ + cycle_s_ : 0;
  if (convergence_met_ && converged_s_ >= run_.cond_time_s) return Outcome::Converged;
  return Outcome::None;
}

void EgmChannel::control(Joints& position, Joints& speed) {
  const double ramp = run_.ramp_in_s > 0 ? std::min(1.0, running_s_ / run_.ramp_in_s) : 1.0;
  const double k = position_given_ ? gain_ * run_.position_gain_share * ramp : 0;
  Joints wanted{};
  double largest = 0, load = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    if (!run_.axes[i]) continue;
    const double target = std::clamp(reference_[i], start_[i] - activation_.max_position_deviation_rad,
                                     start_[i] + activation_.max_position_deviation_rad);
    wanted[i] = k * (target - position[i]) + speed_reference_[i] * ramp;
    largest = std::max(largest, std::abs(wanted[i]));
    load = std::max(load, std::abs(wanted[i]) / arm_.max_speed[i]);
  }
  utilization_ = 100 * load;
  double ratio =
      largest > activation_.max_speed_deviation_rad_s ? activation_.max_speed_deviation_rad_s / largest : 1;
  if (load * ratio > 1) ratio = 1 / load;
  const double pass =
      activation_.low_pass_hz > 0 ? 1 - std::exp(-2 * kPi * activation_.low_pass_hz * cycle_s_) : 1;
  for (std::size_t i = 0; i < 6; ++i) {
    filtered_[i] += pass * (wanted[i] * ratio - filtered_[i]);
    speed[i] = filtered_[i];
    position[i] += filtered_[i] * cycle_s_;
    if (position[i] < arm_.lower[i] || position[i] > arm_.upper[i]) {
      position[i] = std::clamp(position[i], arm_.lower[i], arm_.upper[i]);
      speed[i] = filtered_[i] = 0;
      out_of_range_ = true;
    }
  }
}

bool EgmChannel::converged(const Joints& position) const {
  for (std::size_t i = 0; i < 6; ++i) {
    if (!run_.axes[i]) continue;
    const double low = activation_.min_rad[i], high = activation_.max_rad[i];
    const double error = reference_[i] - position[i];
    if (high - low < kEncoderStep_rad || error < low || error > high) return false;
  }
  return true;
}

bool EgmChannel::frame_due() {
  if (!sending_) return false;
  return cycle_count_++ % std::max(1, activation_.sample_cycles) == 0;
}

}  // namespace weldcell::sim
