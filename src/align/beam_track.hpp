// Where the laser's beam was at any instant: joint poses on the host clock, cubic in between, through the
// kinematics. Pure.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "weldcell/base/time.hpp"
#include "weldcell/cell/cell_setup.hpp"

namespace weldcell::align {

/// The beam at one instant, frame Base, mm and mm/s.
struct Beam {
  Eigen::Vector3d origin, direction;            ///< Laser origin and unit +Z
  Eigen::Vector3d origin_rate, direction_rate;  ///< their derivatives, 1/s
  double receiver_x = 0, receiver_y = 0;        ///< Laser +X in the plane, not normalized
};

/// Joints follow a cubic Hermite through the poses with central-difference speeds. Inside one pose interval
/// the beam is the cubic through the kinematics at four instants of it, which differs from the exact
/// kinematics by less than 1 nm at 500 mm/s, and costs three evaluations an interval whatever the laser's
/// rate.
class BeamTrack {
 public:
  explicit BeamTrack(const cell::CellSetup& cell)
      : arm_(cell.arm), T_flange_laser_(cell.laser.T_flange_laser) {}

  /// Times must increase except where a new piece begins; nothing is interpolated across pieces.
  void add(HostTime time, const kinematics::Joints& joints, bool new_piece);
  /// False when no two poses of one piece, at most 40 ms apart, enclose the instant. Fast when instants
  /// increase.
  bool at(HostTime time, Beam& out);

 private:
  static constexpr std::size_t kValues = 8;  ///< origin, direction, receiver x and y
  using Row = std::array<double, kValues>;
  struct Pose {
    Nanoseconds ns = 0;
    kinematics::Joints joints{};
    bool new_piece = false;
  };
  bool seek(Nanoseconds ns);
  void prepare(std::size_t interval);
  kinematics::Joints speed(std::size_t pose) const;
  Row beam_values(const kinematics::Joints& joints) const;

  kinematics::ArmModel arm_;
  Transform<Flange, Laser> T_flange_laser_;
  std::vector<Pose> poses_;
  std::size_t interval_ = 0, prepared_ = static_cast<std::size_t>(-1);
  Row last_node_{};
  std::array<Row, 4> coefficient_{};  ///< powers of the share of the interval
};

}  // namespace weldcell::align
