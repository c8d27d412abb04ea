// Angles: radians inside, degrees only in wire/, files and the user's face. Pure.
#pragma once

#include <numbers>

namespace weldcell {

inline constexpr double kPi = std::numbers::pi;
constexpr double rad(double deg) { return deg * (kPi / 180.0); }
constexpr double deg(double rad) { return rad * (180.0 / kPi); }

/// The same angle in (-pi, pi].
double wrap_pi(double angle_rad);

}  // namespace weldcell
