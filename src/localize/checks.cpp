#include "checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "weldcell/base/units.hpp"

namespace weldcell::localize {

namespace {

/// Noise and a member's slight turn keep the points of one straight side within this of a line.
constexpr double kOneLine_mm = 2;

}  // namespace

Localization refused(Verdict verdict, const char* cause, std::string reason, std::size_t points) {
  Localization out;
  out.verdict = verdict;
  out.cause = cause;
  out.reason = std::move(reason);
  out.points = static_cast<int>(points);
  out.edge_of_point.assign(points, -1);
  out.residual_mm.assign(points, 0);
  return out;
}

std::string wrong_option(const LocalizeOptions& o) {
  struct Limit {
    const char* name;
    double value, low, high;
  };
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  for (const Limit& l :
       {Limit{"planned.x_mm", o.planned.x_mm, -kFarthest_mm, kFarthest_mm},
        Limit{"planned.y_mm", o.planned.y_mm, -kFarthest_mm, kFarthest_mm},
        Limit{"planned.theta_rad", o.planned.theta_rad, -1e3, 1e3}, Limit{"range_mm", o.range_mm, 0, 2000},
        Limit{"range_rad", o.range_rad, 0, 1e3}, Limit{"max_offset_mm", o.max_offset_mm, 0, kNoLimit},
        Limit{"max_rotation_rad", o.max_rotation_rad, 0, kNoLimit},
        Limit{"max_member_shift_mm", o.max_member_shift_mm, 0, kNoLimit},
        Limit{"prove_shift_mm", o.prove_shift_mm, o.prove_shift_mm == 0 ? 0.0 : 6.0, 100},
        Limit{"max_mean_error_mm", o.max_mean_error_mm, 0, kNoLimit},
        Limit{"latency_sigma_s", o.latency_sigma_s, 0, 1}, Limit{"inset_sigma_mm", o.inset_sigma_mm, 0, 100},
        Limit{"member_shift_sigma_mm", o.member_shift_sigma_mm, 0, 100},
        Limit{"member_angle_sigma_rad", o.member_angle_sigma_rad, 0, kPi}}) {
    if (l.value >= l.low && l.value <= l.high) continue;
    return fmt::format("{} is {:g}, but must lie between {:g} and {:g}", l.name, l.value, l.low, l.high);
  }
  return {};
}

bool on_one_line(const std::vector<Crossing>& crossings) {
  const auto farthest = [&](const Vec2& from) {
    return std::max_element(crossings.begin(), crossings.end(),
                            [&](const Crossing& a, const Crossing& b) {
                              return (a.point - from).squaredNorm() < (b.point - from).squaredNorm();
                            })
        ->point;
  };
  const Vec2 a = farthest(crossings.front().point), b = farthest(a);
  const double length = (b - a).norm();
  if (length <= kOneLine_mm) return true;
  const Vec2 n = Vec2(a.y() - b.y(), b.x() - a.x()) / length;
  return std::all_of(crossings.begin(), crossings.end(),
                     [&](const Crossing& c) { return std::abs(n.dot(c.point - a)) <= kOneLine_mm; });
}

bool sound(const PathPiece& p) {
  return std::max({std::abs(p.x0_mm), std::abs(p.y0_mm), std::abs(p.x1_mm), std::abs(p.y1_mm)}) <
             kFarthest_mm &&
         std::isfinite(p.x0_mm + p.y0_mm + p.x1_mm + p.y1_mm);
}

}  // namespace weldcell::localize
