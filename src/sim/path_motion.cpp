#include "sim/path_motion.hpp"

#include <algorithm>
#include <cmath>

namespace weldcell::sim {

using kinematics::Joints;

namespace {
constexpr double kLineAcceleration = 4000;   // mm/s2, of a loaded arm of this size
constexpr double kSecondsToFullSpeed = 0.3;  // a joint's ramp to its maximum speed
constexpr double kUsableSpeed = 0.95;

double norm(const Joints& v) {
  double sum = 0;
  for (const double x : v) sum += x * x;
  return std::sqrt(sum);
}

double angle_between(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return Eigen::Quaterniond(a.linear()).angularDistance(Eigen::Quaterniond(b.linear()));
}
}  // namespace

PathMotion::PathMotion(const kinematics::ArmModel& arm, double cycle_s) : arm_(arm), cycle_s_(cycle_s) {
  for (std::size_t i = 0; i < 6; ++i) acceleration_[i] = arm.max_speed[i] / kSecondsToFullSpeed;
}

void PathMotion::reset(const Joints& joints) {
  moves_.clear();
  u_s_ = rate_ = 0;
  settle_ = 0;
  still_ = kWindow;
  raw_ = smooth_ = end_ = joints;
  window_.fill(joints);
}

Status PathMotion::add(const Move& move) {
  Segment segment;
  segment.move = move;
  segment.from = end_;
  segment.start = kinematics::forward(arm_, end_).iso * move.tool;
  Status ready = move.kind == Move::Kind::Joint ? prepare_joint(segment) : prepare_path(segment);
  if (!ready) return ready;
  end_ = segment.to;
  if (segment.duration_s < 1e-9) {
    // Nothing to travel; a fine point still stops whatever passes before it.
    if (move.fine && !moves_.empty()) moves_.back().move.fine = true;
    return Done{};
  }
  moves_.push_back(std::move(segment));
  return Done{};
}

Status PathMotion::prepare_joint(Segment& segment) const {
  segment.to = segment.move.joints;
  Joints travel{};
  double duration = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    if (segment.to[i] < arm_.lower[i] || segment.to[i] > arm_.upper[i]) {
      return Error{"motion.reach", "axis " + std::to_string(i + 1),
                   "target outside the joint's working range", ""};
    }
    travel[i] = segment.to[i] - segment.from[i];
    duration = std::max(duration, std::abs(travel[i]) / (kUsableSpeed * arm_.max_speed[i]));
  }
  if (norm(travel) < 1e-10) return Done{};
  const Eigen::Isometry3d end = kinematics::forward(arm_, segment.to).iso * segment.move.tool;
  duration =
      std::max(duration, (end.translation() - segment.start.translation()).norm() / segment.move.speed_mm_s);
  duration = std::max(duration, angle_between(segment.start, end) / segment.move.turn_rad_s);
  segment.duration_s = duration;
  for (std::size_t i = 0; i < 6; ++i) segment.tangent_in[i] = segment.tangent_out[i] = travel[i] / duration;
  finish_limits(segment, segment.tangent_in);
  return Done{};
}

Status PathMotion::prepare_circle(Segment& segment) const {
  const Eigen::Vector3d a = segment.start.translation(), b = segment.move.via.translation(),
                        c = segment.move.target.translation();
  const Eigen::Vector3d ab = b - a, ac = c - a, normal = ab.cross(ac);
  if (normal.norm() < 1e-6 * std::max(1.0, ab.norm() * ac.norm())) {
    return Error{"motion.circle", "MoveC", "start, via and end lie on a line or coincide", "use MoveL"};
  }
  const double n2 = normal.squaredNorm();
  // Circumcentre of a triangle: a + (|ac|^2 (ab x ac) x ab + |ab|^2 ac x (ab x ac)) / (2 |ab x ac|^2).
  segment.center = a + (ac.squaredNorm() * normal.cross(ab) + ab.squaredNorm() * ac.cross(normal)) / (2 * n2);
  segment.axis = normal.normalized();
  const auto turn = [&](const Eigen::Vector3d& to) {
    const Eigen::Vector3d x = a - segment.center, y = to - segment.center;
    const double angle = std::atan2(segment.axis.dot(x.cross(y)), x.dot(y));
    return angle < 0 ? angle + 2 * M_PI : angle;
  };
  segment.sweep_rad = turn(c);
  return Done{};
}

Status PathMotion::prepare_path(Segment& segment) const {
  double length = (segment.move.target.translation() - segment.start.translation()).norm();
  if (segment.move.kind == Move::Kind::Circle) {
    if (Status round = prepare_circle(segment); !round) return round;
    length = segment.sweep_rad * (segment.start.translation() - segment.center).norm();
  }
  const double turn = angle_between(segment.start, segment.move.target);
  segment.duration_s = std::max(length / segment.move.speed_mm_s, turn / segment.move.turn_rad_s);
  if (length < 1e-6 && turn < 1e-7) {
    segment.duration_s = 0;
    segment.to = segment.from;
    return Done{};
  }
  return walk(segment);
}

Eigen::Isometry3d PathMotion::pose(const Segment& segment, double fraction) const {
  Eigen::Isometry3d out;
  const Eigen::Quaterniond from(segment.start.linear()), to(segment.move.target.linear());
  out.linear() = from.slerp(fraction, to).toRotationMatrix();
  if (segment.move.kind == Move::Kind::Circle) {
    out.translation() = segment.center + Eigen::AngleAxisd(segment.sweep_rad * fraction, segment.axis) *
                                             (segment.start.translation() - segment.center);
  } else {
    out.translation() = segment.start.translation() +
                        fraction * (segment.move.target.translation() - segment.start.translation());
  }
  out.makeAffine();
  return out;
}

Status PathMotion::walk(Segment& segment) const {
  const double length = segment.duration_s * segment.move.speed_mm_s;
  const int steps = std::clamp(static_cast<int>(length / 4.0), 8, 400);
  const Eigen::Isometry3d tool_inverse = segment.move.tool.inverse();
  Joints last = segment.from, fastest{};
  for (int k = 1; k <= steps; ++k) {
    const Eigen::Isometry3d tcp = pose(segment, static_cast<double>(k) / steps);
    Joints now{};
    if (!kinematics::inverse_near(arm_, {tcp * tool_inverse}, last, 0, 0.6, now)) {
      const bool some = !kinematics::inverse(arm_, {tcp * tool_inverse}, last).empty();
      return Error{some ? "motion.singular" : "motion.reach", "",
                   some ? "a joint would have to jump on the way" : "position outside reach", ""};
    }
    const double dt = segment.duration_s / steps;
    for (std::size_t i = 0; i < 6; ++i) {
      const double speed = (now[i] - last[i]) / dt;
      fastest[i] = std::max(fastest[i], std::abs(speed));
      if (k == 1) segment.tangent_in[i] = speed;
      if (k == steps) segment.tangent_out[i] = speed;
    }
    last = now;
  }
  segment.to = last;
  if (segment.move.check_configuration &&
      !(kinematics::configuration(arm_, last) == segment.move.configuration)) {
    return Error{"motion.configuration", "", "the target's configuration is not the one the path leads to",
                 ""};
  }
  double stretch = 1;
  for (std::size_t i = 0; i < 6; ++i)
    stretch = std::max(stretch, fastest[i] / (kUsableSpeed * arm_.max_speed[i]));
  segment.duration_s *= stretch;
  for (std::size_t i = 0; i < 6; ++i) {
    fastest[i] /= stretch;
    segment.tangent_in[i] /= stretch;
    segment.tangent_out[i] /= stretch;
  }
  finish_limits(segment, fastest);
  return Done{};
}

void PathMotion::finish_limits(Segment& segment, const Joints& fastest) const {
  double acceleration = kLineAcceleration / segment.move.speed_mm_s;
  for (std::size_t i = 0; i < 6; ++i) {
    if (std::abs(fastest[i]) > 1e-9)
      acceleration = std::min(acceleration, acceleration_[i] / std::abs(fastest[i]));
  }
  segment.acceleration = acceleration;
}

double PathMotion::corner_ratio(const Segment& a, const Segment& b) const {
  const double na = norm(a.tangent_out), nb = norm(b.tangent_in);
  if (na < 1e-9 || nb < 1e-9) return 0;
  const double window = kWindow * cycle_s_;
  double out = 1;
  for (std::size_t i = 0; i < 6; ++i) {
    const double jump = std::abs(a.tangent_out[i] - b.tangent_in[i] * na / nb);
    if (jump > 1e-9) out = std::min(out, acceleration_[i] * window / jump);
  }
  return out;
}

double PathMotion::end_ratio() const {
  double at_end = 0;
  for (std::size_t k = moves_.size(); k-- > 1;) {
    const Segment &a = moves_[k - 1], &b = moves_[k];
    if (a.move.fine) {
      at_end = 0;
      continue;
    }
    const double entry = std::min(1.0, std::sqrt(at_end * at_end + 2 * b.acceleration * b.duration_s));
    const double na = norm(a.tangent_out), nb = norm(b.tangent_in);
    at_end = na < 1e-9 ? 0 : std::min({1.0, entry * nb / na, corner_ratio(a, b)});
  }
  return moves_.front().move.fine ? 0 : at_end;
}

void PathMotion::step(double speed_ratio, bool hold) {
  if (settle_ > 0) --settle_;
  if (!moves_.empty() && settle_ == 0) {
    const Segment& segment = moves_.front();
    const double left = segment.duration_s - u_s_, end = end_ratio(), dr = segment.acceleration * cycle_s_;
    const double wanted =
        hold ? 0.0 : std::min(speed_ratio, std::sqrt(end * end + 2 * segment.acceleration * left));
    rate_ = wanted > rate_ ? std::min(wanted, rate_ + dr) : std::max(wanted, rate_ - (hold ? dr : 2 * dr));
    u_s_ += rate_ * cycle_s_;
    if (u_s_ >= segment.duration_s - 1e-12 && rate_ > 0) {
      const double over_s = (u_s_ - segment.duration_s) / rate_;
      raw_ = segment.to;
      const bool stop = segment.move.fine || moves_.size() == 1;
      double next_rate = 0;
      if (!stop) {
        const double nb = norm(moves_[1].tangent_in);
        next_rate = nb < 1e-9 ? 0 : std::min(1.0, rate_ * norm(segment.tangent_out) / nb);
      }
      moves_.pop_front();
      rate_ = next_rate;
      u_s_ = std::max(0.0, over_s) * next_rate;
      if (stop) settle_ = kWindow;
    }
  }
  if (!moves_.empty() && settle_ == 0) {
    const Segment& segment = moves_.front();
    const double fraction = std::clamp(u_s_ / segment.duration_s, 0.0, 1.0);
    if (segment.move.kind == Move::Kind::Joint) {
      for (std::size_t i = 0; i < 6; ++i) {
        raw_[i] = segment.from[i] + fraction * (segment.to[i] - segment.from[i]);
      }
    } else if (rate_ > 0) {
      Joints now{};
      // walk() has been along this path, so a solution near the last one exists.
      if (kinematics::inverse_near(arm_, {pose(segment, fraction) * segment.move.tool.inverse()}, raw_, 0,
                                   0.6, now)) {
        raw_ = now;
      }
    }
  }
  smooth();
}

void PathMotion::smooth() {
  still_ = window_[window_at_] == raw_ && rate_ == 0 ? std::min(still_ + 1, kWindow) : 0;
  window_at_ = (window_at_ + 1) % kWindow;
  window_[window_at_] = raw_;
  if (still_ >= kWindow) {
    smooth_ = raw_;
    return;
  }
  smooth_ = {};
  for (const Joints& joints : window_) {
    for (std::size_t i = 0; i < 6; ++i) smooth_[i] += joints[i] / kWindow;
  }
}

}  // namespace weldcell::sim
