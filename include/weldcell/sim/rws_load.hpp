// How many requests a simulated controller is asked in a second, and which it refuses. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>

namespace weldcell::sim {

class RwsLoad {
 public:
  /// More than `most_per_s` within a second are refused (503), and do not count for those after them; 0: none
  /// is refused.
  explicit RwsLoad(double most_per_s) : most_per_s_(most_per_s) {}
  /// A request arrives; times never go backwards. False: refused.
  bool admit(double now_s);
  /// The most that ever arrived within one second, refused ones included.
  std::size_t most_in_a_second() const { return most_; }
  std::uint64_t total() const { return total_; }
  std::uint64_t refused() const { return refused_; }

 private:
  double most_per_s_;
  std::deque<double> admitted_s_, arrived_s_;
  std::size_t most_ = 0;
  std::uint64_t total_ = 0, refused_ = 0;
};

}  // namespace weldcell::sim
