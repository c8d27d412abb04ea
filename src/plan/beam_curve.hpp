// A beam path as a smooth curve with a speed along it, and the quintic blends between such curves. Pure.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "weldcell/geometry/plane.hpp"

namespace weldcell::plan {

/// x mm, y mm and the receiver's angle rad (unwrapped), with derivatives.
struct BeamState {
  Eigen::Vector3d place = Eigen::Vector3d::Zero(), rate = Eigen::Vector3d::Zero(),
                  acceleration = Eigen::Vector3d::Zero();
};

/// The polynomial of fifth order that joins two states in a given time; C2 at both ends.
class Blend {
 public:
  Blend(const BeamState& from, const BeamState& to, double duration_s);
  double duration_s() const { return duration_s_; }
  BeamState at(double time_s) const;
  Eigen::Vector3d jerk_at(double time_s) const;

 private:
  Eigen::Matrix<double, 3, 6> coefficient_;
  double duration_s_;
};

/// C2 cubic spline through points, by chord length; two points are a straight line.
class Curve {
 public:
  explicit Curve(const std::vector<Vec2>& points);
  double length_mm() const { return knots_.back(); }
  struct Local {
    Vec2 point, tangent, bend;  ///< p, p', p'' by length
  };
  Local at(double s_mm) const;

 private:
  std::vector<double> knots_;
  std::vector<Vec2> points_, bends_;
};

/// Speed along a curve, as smooth as its neighbourhood allows and nowhere above the cap, with its time law.
class SpeedProfile {
 public:
  /// caps_mm_s holds the highest speed at equally spaced places over the whole length; smooth_mm is the half
  /// window.
  SpeedProfile(double length_mm, const std::vector<double>& caps_mm_s, double smooth_mm);
  double duration_s() const { return times_.back(); }
  struct Along {
    double s_mm, speed_mm_s, acceleration_mm_s2;
  };
  Along at(double time_s) const;

 private:
  double step_mm_;
  std::vector<double> speeds_, times_;
};

/// A path that the beam follows at its measuring speed, the receiver held at one angle.
class MeasuredPath {
 public:
  MeasuredPath(Curve curve, SpeedProfile speed, double receiver_rad)
      : curve_(std::move(curve)), speed_(std::move(speed)), receiver_rad_(receiver_rad) {}
  double duration_s() const { return speed_.duration_s(); }
  BeamState at(double time_s) const;
  double length_at(double time_s) const { return speed_.at(time_s).s_mm; }
  double speed_at(double time_s) const { return speed_.at(time_s).speed_mm_s; }

 private:
  Curve curve_;
  SpeedProfile speed_;
  double receiver_rad_;
};

}  // namespace weldcell::plan
