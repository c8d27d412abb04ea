#include "search.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "weldcell/base/units.hpp"

namespace weldcell::localize {

namespace {

/// Eight 16-bit sums at once; GCC and Clang turn it into one instruction on any machine that has one.
using Lane = std::uint16_t __attribute__((vector_size(16)));
constexpr int kLane = 8;

/// The turn moves the farthest point by about this much from one angle to the next.
constexpr double kTurnStep_mm = 14;
constexpr double kRangeMargin_mm = 8;

/// Sums of the score grid over all points, for every shift of a square of (2 reach + 1) cells.
class ShiftScores {
 public:
  explicit ShiftScores(int reach_cells)
      : reach_(reach_cells),
        side_(2 * reach_cells + 1),
        stride_((side_ + kLane - 1) / kLane * kLane),
        sums_(static_cast<std::size_t>(side_) * static_cast<std::size_t>(stride_)) {}

  void clear() { std::fill(sums_.begin(), sums_.end(), std::uint16_t{0}); }
  int side() const { return side_; }
  std::uint16_t at(int row, int column) const {
    return sums_[static_cast<std::size_t>(row * stride_ + column)];
  }

  /// Adds the grid's square around the cell of a point.
  void add(const TemplateFields& fields, const std::uint16_t* grid, int cell_row, int cell_column) {
    const int row0 = cell_row - reach_, column0 = cell_column - reach_;
    const int first = std::max(0, -row0), last = std::min(side_, fields.rows() - row0);
    if (column0 >= fields.columns() || column0 + side_ <= 0) return;
    const bool inside = column0 >= 0 && column0 + stride_ <= fields.columns();
    for (int row = first; row < last; ++row) {
      const std::uint16_t* from = grid + static_cast<std::ptrdiff_t>(row0 + row) * fields.columns();
      std::uint16_t* to = sums_.data() + static_cast<std::ptrdiff_t>(row) * stride_;
      if (inside) {
        add_lanes(to, from + column0);
      } else {
        const int begin = std::max(0, -column0), end = std::min(side_, fields.columns() - column0);
        for (int column = begin; column < end; ++column) {
          to[column] = static_cast<std::uint16_t>(to[column] + from[column0 + column]);
        }
      }
    }
  }

 private:
  void add_lanes(std::uint16_t* to, const std::uint16_t* from) const {
    for (int i = 0; i < stride_; i += kLane) {
      Lane a, b;
      std::memcpy(&a, to + i, sizeof a);
      std::memcpy(&b, from + i, sizeof b);
      a += b;
      std::memcpy(to + i, &a, sizeof a);
    }
  }

  int reach_, side_, stride_;
  std::vector<std::uint16_t> sums_;
};

struct Peak {
  int row = 0, column = 0, sum = -1;
};

/// The highest sum and the highest one well apart from it, among the shifts that `allowed` admits.
template <typename Allowed>
void two_peaks(const ShiftScores& scores, Allowed&& allowed, Peak& first, Peak& second) {
  first = second = Peak{};
  for (int row = 0; row < scores.side(); ++row) {
    for (int column = 0; column < scores.side(); ++column) {
      const int sum = scores.at(row, column);
      if (sum > first.sum && allowed(row, column)) first = {row, column, sum};
    }
  }
  for (int row = 0; row < scores.side(); ++row) {
    for (int column = 0; column < scores.side(); ++column) {
      const int sum = scores.at(row, column);
      if (sum <= second.sum || (std::abs(row - first.row) <= 3 && std::abs(column - first.column) <= 3))
        continue;
      if (allowed(row, column)) second = {row, column, sum};
    }
  }
}

std::vector<double> turns(const TemplateFields& fields, const SearchBox& box) {
  const double step = std::clamp(kTurnStep_mm / std::max(fields.radius_mm(), 1.0), rad(0.2), rad(4.0));
  std::vector<double> out;
  if (box.range_rad >= kPi) {
    const int count = static_cast<int>(std::ceil(2 * kPi / step));
    for (int i = 0; i < count; ++i) out.push_back(box.planned.theta_rad + 2 * kPi * i / count);
    return out;
  }
  const int half = static_cast<int>(std::ceil(box.range_rad / step));
  const double width = half > 0 ? box.range_rad / half : 0;
  for (int i = -half; i <= half; ++i) out.push_back(box.planned.theta_rad + i * width);
  return out;
}

bool distinct(const TemplateFields& fields, const CentredPose& a, const CentredPose& b) {
  return std::abs(wrap_pi(a.theta_rad - b.theta_rad)) * fields.radius_mm() > 40 ||
         (a.centre - b.centre).norm() > 30;
}

std::uint64_t spread_bits(std::uint32_t v) {
  std::uint64_t x = v & 0xffff;
  x = (x | (x << 8)) & 0x00ff00ff;
  x = (x | (x << 4)) & 0x0f0f0f0f;
  x = (x | (x << 2)) & 0x33333333;
  return (x | (x << 1)) & 0x55555555;
}

/// Place on the Z-order curve with cells of 4 mm: neighbours on the plane stay neighbours in the order.
std::uint64_t curve_place(const Vec2& p, const Vec2& low) {
  const auto cell = [](double v) { return static_cast<std::uint32_t>(std::clamp(v / 4, 0.0, 65535.0)); };
  return spread_bits(cell(p.x() - low.x())) | (spread_bits(cell(p.y() - low.y())) << 1);
}

}  // namespace

std::vector<Crossing> sampled(const std::vector<Crossing>& crossings, std::size_t count) {
  if (crossings.size() <= count) return crossings;
  Vec2 low = crossings.front().point;
  for (const Crossing& c : crossings) low = low.cwiseMin(c.point);
  std::vector<std::pair<std::uint64_t, std::size_t>> order(crossings.size());
  for (std::size_t i = 0; i < crossings.size(); ++i) order[i] = {curve_place(crossings[i].point, low), i};
  std::sort(order.begin(), order.end());
  std::vector<Crossing> out;
  out.reserve(count);
  for (std::size_t i = 0; i < count; ++i)
    out.push_back(crossings[order[i * crossings.size() / count].second]);
  return out;
}

namespace {

Vec2 turned(const Vec2& v, double theta) {
  return {std::cos(theta) * v.x() - std::sin(theta) * v.y(),
          std::sin(theta) * v.x() + std::cos(theta) * v.y()};
}

/// Where the centroid may lie at one turn: about where it is planned, or where turning about the part's
/// origin carries it; one square for both when they overlap well.
struct Square {
  Vec2 centre;
  double reach_mm;
};
std::vector<Square> squares(const SearchBox& box, double theta) {
  const double reach = box.range_mm + kRangeMargin_mm;
  const Vec2 planned = box.planned.centre;
  const Vec2 carried = planned + turned(box.origin, box.planned.theta_rad) - turned(box.origin, theta);
  const double apart = (carried - planned).cwiseAbs().maxCoeff();
  if (apart <= 0.8 * reach) return {{0.5 * (planned + carried), reach + 0.5 * apart}};
  return {{planned, reach}, {carried, reach}};
}

/// The best two shifts of one square at one turn.
void search_square(const TemplateFields& fields, const std::vector<Crossing>& points, const Square& square,
                   double theta, std::vector<Mode>& found) {
  const double c = std::cos(theta), s = std::sin(theta), cell = fields.cell_mm();
  ShiftScores scores(static_cast<int>(std::ceil(square.reach_mm * (std::abs(c) + std::abs(s)) / cell)));
  const int middle = (scores.side() - 1) / 2;
  for (const Crossing& point : points) {
    const Vec2 d = point.point - square.centre;
    const double x = (c * d.x() + s * d.y() - fields.origin().x()) / cell;
    const double y = (-s * d.x() + c * d.y() - fields.origin().y()) / cell;
    if (!(std::abs(x) < 1e6 && std::abs(y) < 1e6)) continue;
    const int bin = point.signed_step ? bin_of(point.inward_rad - theta) : kAnyBin;
    scores.add(fields, fields.scores(bin), static_cast<int>(std::floor(y)), static_cast<int>(std::floor(x)));
  }
  // A cell (row, column) stands for points shifted by it in part axes: the centroid moves the other way.
  const auto shift_of = [&](int row, int column) {
    return Vec2(-turned({(column - middle) * cell, (row - middle) * cell}, theta));
  };
  const auto allowed = [&](int row, int column) {
    return shift_of(row, column).cwiseAbs().maxCoeff() <= square.reach_mm;
  };
  Peak first, second;
  two_peaks(scores, allowed, first, second);
  for (const Peak& peak : {first, second}) {
    if (peak.sum <= 0) continue;
    found.push_back({{square.centre + shift_of(peak.row, peak.column), wrap_pi(theta)},
                     peak.sum / (255.0 * static_cast<double>(points.size()))});
  }
}

}  // namespace

bool SearchBox::holds(const CentredPose& pose, double slack_mm, double slack_rad) const {
  const Vec2 origin_off =
      pose.centre + turned(origin, pose.theta_rad) - planned.centre - turned(origin, planned.theta_rad);
  const double off =
      std::min((pose.centre - planned.centre).cwiseAbs().maxCoeff(), origin_off.cwiseAbs().maxCoeff());
  return off <= range_mm + slack_mm &&
         (range_rad >= kPi || std::abs(wrap_pi(pose.theta_rad - planned.theta_rad)) <= range_rad + slack_rad);
}

std::vector<Mode> search(const TemplateFields& fields, const std::vector<Crossing>& crossings,
                         const SearchBox& box, std::size_t max_modes) {
  const std::vector<Crossing> points = sampled(crossings, kSearchPoints);
  std::vector<Mode> found;
  if (points.empty()) return found;
  for (const double theta : turns(fields, box)) {
    for (const Square& square : squares(box, theta)) search_square(fields, points, square, theta, found);
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Mode& a, const Mode& b) { return a.score > b.score; });
  std::vector<Mode> modes;
  for (const Mode& mode : found) {
    if (modes.size() == max_modes) break;
    if (std::all_of(modes.begin(), modes.end(),
                    [&](const Mode& m) { return distinct(fields, m.pose, mode.pose); })) {
      modes.push_back(mode);
    }
  }
  return modes;
}

}  // namespace weldcell::localize
