// The simulated laser: samples on its own clock, ray-cast on the members as they really lie, as bytes of the
// dialect that the cell file names.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "weldcell/base/time.hpp"
#include "weldcell/geometry/transform.hpp"
#include "weldcell/sim/scene.hpp"

namespace weldcell::sim {

/// Bytes that leave the sensor together and when they arrive at the host (true time).
struct LaserBlock {
  HostTime arrival;
  std::vector<std::byte> bytes;
};

class LaserDevice {
 public:
  using PoseAt = std::function<Transform<Base, Flange>(HostTime)>;
  explicit LaserDevice(const Scene& scene);
  ~LaserDevice();

  /// All blocks whose samples were taken up to true time `now`; pose_at is asked for instants up to `now` and
  /// half an exposure more.
  std::vector<LaserBlock> advance(HostTime now, const PoseAt& pose_at);
  /// "laser_drop": the connection is gone for duration_s (0: for good); "laser_stall": blocks are held back
  /// that long; "laser_clock_step", "laser_clock_back": its clock leaps by that much; "laser_clock_stop": it
  /// stands still that long; "laser_clock_reset": clock and running number begin at 0. False when the kind is
  /// unknown.
  bool inject(const std::string& fault, double duration_s);
  /// False while a drop lasts.
  bool connected() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace weldcell::sim
