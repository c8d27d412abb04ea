#include "sim/servo.hpp"

#include <algorithm>
#include <cmath>

namespace weldcell::sim {

using kinematics::Joints;

Servo::Servo(double cycle_s, double dead_time_s, const Joints& at)
    : cycle_s_(cycle_s), delay_cycles_(std::clamp(dead_time_s / cycle_s, 0.0, 62.0)) {
  line_.fill(at);
  record_.fill({{}, at, {}});
}

void Servo::step(HostTime now, const Joints& reference) {
  line_at_ = (line_at_ + 1) % line_.size();
  line_[line_at_] = reference;
  const auto whole = static_cast<std::size_t>(delay_cycles_);
  const double part = delay_cycles_ - static_cast<double>(whole);
  const Joints& a = line_[(line_at_ + line_.size() - whole) % line_.size()];
  const Joints& b = line_[(line_at_ + line_.size() - whole - 1) % line_.size()];
  const Joints last = posture();
  at_ = (at_ + 1) % kRemembered;
  count_ = std::min(count_ + 1, kRemembered);
  Record& record = record_[at_];
  record.t = now;
  for (std::size_t i = 0; i < 6; ++i) {
    record.joints[i] = a[i] + part * (b[i] - a[i]);
    record.speed[i] = (record.joints[i] - last[i]) / cycle_s_;
  }
}

Joints Servo::posture_at(HostTime t) const {
  const double cycles = seconds(back(0).t - t) / cycle_s_;
  if (cycles <= 0) return posture();
  std::size_t k = std::min(static_cast<std::size_t>(cycles), count_ - 1);
  while (k > 0 && back(k).t < t) --k;
  while (k + 1 < count_ && back(k).t > t) ++k;
  const Record& a = back(k);
  if (k == 0 || a.t >= t) return a.joints;
  const Record& b = back(k - 1);
  const double h = seconds(b.t - a.t), u = seconds(t - a.t) / h;
  // Hermite with central speeds: the mean of the two neighbouring cycles' speeds at each end.
  const Joints& after = k >= 2 ? back(k - 2).speed : b.speed;
  Joints out{};
  for (std::size_t i = 0; i < 6; ++i) {
    const double va = 0.5 * (a.speed[i] + b.speed[i]) * h, vb = 0.5 * (b.speed[i] + after[i]) * h;
    const double d = b.joints[i] - a.joints[i];
    out[i] = a.joints[i] + u * (va + u * (3 * d - 2 * va - vb + u * (va + vb - 2 * d)));
  }
  return out;
}

}  // namespace weldcell::sim
