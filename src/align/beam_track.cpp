#include "beam_track.hpp"

#include <algorithm>

#include "weldcell/kinematics/arm_model.hpp"

namespace weldcell::align {
namespace {
constexpr Nanoseconds kLongestInterval = 40 * kMillisecond;
}

void BeamTrack::add(HostTime time, const kinematics::Joints& joints, bool new_piece) {
  poses_.push_back({time.ns, joints, new_piece || poses_.empty()});
}

bool BeamTrack::seek(Nanoseconds ns) {
  if (poses_.size() < 2) return false;
  const auto holds = [&](std::size_t i) { return poses_[i].ns <= ns && ns <= poses_[i + 1].ns; };
  for (int step = 0; step < 4 && interval_ + 1 < poses_.size(); ++step) {
    if (holds(interval_)) return true;
    if (ns < poses_[interval_].ns || interval_ + 2 >= poses_.size()) break;
    ++interval_;
  }
  const auto after = std::upper_bound(poses_.begin(), poses_.end(), ns,
                                      [](Nanoseconds t, const Pose& pose) { return t < pose.ns; });
  if (after == poses_.begin()) return false;
  interval_ = std::min<std::size_t>(static_cast<std::size_t>(after - poses_.begin()) - 1, poses_.size() - 2);
  return holds(interval_);
}

kinematics::Joints BeamTrack::speed(std::size_t pose) const {
  const bool before = !poses_[pose].new_piece;
  const bool after = pose + 1 < poses_.size() && !poses_[pose + 1].new_piece;
  kinematics::Joints out{};
  for (std::size_t j = 0; j < out.size(); ++j) {
    double back = 0, ahead = 0, h0 = 0, h1 = 0;
    if (before) {
      h0 = seconds(poses_[pose].ns - poses_[pose - 1].ns);
      back = (poses_[pose].joints[j] - poses_[pose - 1].joints[j]) / h0;
    }
    if (after) {
      h1 = seconds(poses_[pose + 1].ns - poses_[pose].ns);
      ahead = (poses_[pose + 1].joints[j] - poses_[pose].joints[j]) / h1;
    }
    if (before && after) {
      out[j] = (back * h1 + ahead * h0) / (h0 + h1);
    } else {
      out[j] = before ? back : ahead;
    }
  }
  return out;
}

BeamTrack::Row BeamTrack::beam_values(const kinematics::Joints& joints) const {
  const Transform<Base, Laser> T_base_laser = kinematics::forward(arm_, joints) * T_flange_laser_;
  const auto& m = T_base_laser.iso.matrix();
  return {m(0, 3), m(1, 3), m(2, 3), m(0, 2), m(1, 2), m(2, 2), m(0, 0), m(1, 0)};
}

void BeamTrack::prepare(std::size_t interval) {
  const Pose &a = poses_[interval], &b = poses_[interval + 1];
  const double h = seconds(b.ns - a.ns);
  const kinematics::Joints va = speed(interval), vb = speed(interval + 1);
  const auto joints_at = [&](double s) {
    const double s2 = s * s, s3 = s2 * s;
    kinematics::Joints q{};
    for (std::size_t j = 0; j < q.size(); ++j) {
      q[j] = (2 * s3 - 3 * s2 + 1) * a.joints[j] + (s3 - 2 * s2 + s) * h * va[j] +
             (3 * s2 - 2 * s3) * b.joints[j] + (s3 - s2) * h * vb[j];
    }
    return q;
  };
  const bool follows = prepared_ + 1 == interval && !a.new_piece;
  const Row f0 = follows ? last_node_ : beam_values(a.joints);
  const Row f1 = beam_values(joints_at(1.0 / 3)), f2 = beam_values(joints_at(2.0 / 3)),
            f3 = beam_values(b.joints);
  for (std::size_t k = 0; k < kValues; ++k) {
    coefficient_[0][k] = f0[k];
    coefficient_[1][k] = -5.5 * f0[k] + 9 * f1[k] - 4.5 * f2[k] + f3[k];
    coefficient_[2][k] = 9 * f0[k] - 22.5 * f1[k] + 18 * f2[k] - 4.5 * f3[k];
    coefficient_[3][k] = -4.5 * f0[k] + 13.5 * f1[k] - 13.5 * f2[k] + 4.5 * f3[k];
  }
  last_node_ = f3;
  prepared_ = interval;
}

bool BeamTrack::at(HostTime time, Beam& out) {
  if (!seek(time.ns)) return false;
  const Pose &a = poses_[interval_], &b = poses_[interval_ + 1];
  if (b.new_piece || b.ns - a.ns > kLongestInterval) return false;
  if (prepared_ != interval_) prepare(interval_);
  const double h = seconds(b.ns - a.ns), s = seconds(time.ns - a.ns) / h;
  Row value, rate;
  for (std::size_t k = 0; k < kValues; ++k) {
    const double c1 = coefficient_[1][k], c2 = coefficient_[2][k], c3 = coefficient_[3][k];
    value[k] = coefficient_[0][k] + s * (c1 + s * (c2 + s * c3));
    rate[k] = (c1 + s * (2 * c2 + s * 3 * c3)) / h;
  }
  out.origin = {value[0], value[1], value[2]};
  out.direction = {value[3], value[4], value[5]};
  out.origin_rate = {rate[0], rate[1], rate[2]};
  out.direction_rate = {rate[3], rate[4], rate[5]};
  out.receiver_x = value[6];
  out.receiver_y = value[7];
  return true;
}

}  // namespace weldcell::align
