#include "weldcell/base/units.hpp"

#include <cmath>

namespace weldcell {

double wrap_pi(double angle_rad) {
  const double wrapped = std::remainder(angle_rad, 2 * kPi);
  return wrapped <= -kPi ? kPi : wrapped;
}

}  // namespace weldcell
