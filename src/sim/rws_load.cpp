#include "weldcell/sim/rws_load.hpp"

#include <algorithm>

namespace weldcell::sim {

bool RwsLoad::admit(double now_s) {
  const auto forget = [now_s](std::deque<double>& times) {
    while (!times.empty() && times.front() <= now_s - 1) times.pop_front();
  };
  forget(arrived_s_);
  forget(admitted_s_);
  arrived_s_.push_back(now_s);
  most_ = std::max(most_, arrived_s_.size());
  ++total_;
  if (most_per_s_ > 0 && static_cast<double>(admitted_s_.size()) >= most_per_s_) {
    ++refused_;
    return false;
  }
  admitted_s_.push_back(now_s);
  return true;
}

}  // namespace weldcell::sim
