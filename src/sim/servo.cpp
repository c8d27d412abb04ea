#include "sim/servo.hpp"

#include <algorithm>
#include <cmath>

namespace weldcell::sim {

using kinematics::Joints;

Servo::Servo(double cycle_s, double dead_time_s, const Joints& at)
    : cycle_s_(cycle_s), delay_cycles_(1 + std::clamp(dead_time_s / cycle_s, 0.0, 60.0)) {
  line_.fill(at);
  record_.fill(at);
}

void Servo::step(HostTime now, const Joints& reference) {
  line_at_ = (line_at_ + 1) % line_.size();
  line_[line_at_] = reference;
  now_ = now;
  const Joints posture = at_cycle(0);
  at_ = (at_ + 1) % kRemembered;
  record_[at_] = posture;
  count_ = std::min(count_ + 1, static_cast<int>(kRemembered));
}

Joints Servo::at_cycle(int k) const {
  if (k < 0)
    return record_[(at_ + kRemembered - static_cast<std::size_t>(std::min(-k, count_ - 1))) % kRemembered];
  // The arm shows the reference of `delay` cycles ago.
  const double back = std::max(0.0, delay_cycles_ - k), whole = std::floor(back), part = back - whole;
  const auto age = static_cast<std::size_t>(whole);
  const Joints& a = line_[(line_at_ + line_.size() - age) % line_.size()];
  const Joints& b = line_[(line_at_ + line_.size() - age - 1) % line_.size()];
  Joints out{};
  for (std::size_t i = 0; i < 6; ++i) out[i] = a[i] + part * (b[i] - a[i]);
  return out;
}

Joints Servo::posture_at(HostTime t) const {
  const double x = seconds(t - now_) / cycle_s_, whole = std::floor(x), u = x - whole;
  const int k = static_cast<int>(std::clamp(whole, -1.0 * static_cast<double>(kRemembered), 1000.0));
  const Joints a = at_cycle(k);
  if (u < 1e-9) return a;
  const Joints before = at_cycle(k - 1), b = at_cycle(k + 1), after = at_cycle(k + 2);
  Joints out{};
  for (std::size_t i = 0; i < 6; ++i) {
    // Hermite with central slopes.
    const double va = 0.5 * (b[i] - before[i]), vb = 0.5 * (after[i] - a[i]), d = b[i] - a[i];
    out[i] = a[i] + u * (va + u * (3 * d - 2 * va - vb + u * (va + vb - 2 * d)));
  }
  return out;
}

}  // namespace weldcell::sim
