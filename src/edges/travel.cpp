#include "travel.hpp"

#include <algorithm>
#include <cmath>

namespace weldcell::edges {
namespace {

constexpr double kHole = 1.0;           // mm without any point: a run ends
constexpr double kInvalidHole = 1.0;    // mm without a valid point: a path piece ends
constexpr double kPathStep = 0.5;       // mm between the points from which path pieces are made
constexpr double kStraight = 0.2;       // mm that a path piece may differ from the travel
constexpr double kShortestPiece = 0.5;  // mm
constexpr int kPlacePoints = 8;

struct Foot {
  double s, x, y;
};

double distance_to_chord(const Foot& p, const Foot& a, const Foot& b) {
  const double dx = b.x - a.x, dy = b.y - a.y, length = std::hypot(dx, dy);
  if (length < 1e-9) return std::hypot(p.x - a.x, p.y - a.y);
  return std::abs((p.x - a.x) * dy - (p.y - a.y) * dx) / length;
}

/// Longest straight pieces first found by doubling, so that the cost stays linear in the length but for a
/// logarithm.
void straighten(const std::vector<Foot>& feet, std::vector<PathPiece>& out) {
  const auto straight = [&](std::size_t a, std::size_t b) {
    for (std::size_t i = a + 1; i < b; ++i) {
      if (distance_to_chord(feet[i], feet[a], feet[b]) > kStraight) return false;
    }
    return true;
  };
  std::size_t a = 0;
  while (a + 1 < feet.size()) {
    std::size_t good = a + 1, stride = 2;
    while (a + stride < feet.size() && straight(a, a + stride)) {
      good = a + stride;
      stride *= 2;
    }
    std::size_t bad = std::min(feet.size(), a + stride);
    while (good + 1 < bad) {
      const std::size_t middle = good + (bad - good) / 2;
      (straight(a, middle) ? good : bad) = middle;
    }
    out.push_back({feet[a].x, feet[a].y, feet[good].x, feet[good].y});
    a = good;
  }
}

void close_piece(std::vector<Foot>& feet, double margin_mm, std::vector<PathPiece>& out) {
  if (!feet.empty()) {
    const double from = feet.front().s + margin_mm, to = feet.back().s - margin_mm;
    std::erase_if(feet, [&](const Foot& f) { return f.s < from || f.s > to; });
    if (!feet.empty() && feet.back().s - feet.front().s >= kShortestPiece) straighten(feet, out);
  }
  feet.clear();
}

}  // namespace

double speed_mm_s(const align::SurfacePoint& point) {
  const double x = static_cast<double>(point.vx_mm_s), y = static_cast<double>(point.vy_mm_s);
  return std::sqrt(x * x + y * y);
}

Travel::Travel(std::span<const align::SurfacePoint> points, double min_speed_mm_s) {
  s_mm_.resize(points.size());
  std::size_t begin = 0;
  double s = 0, last_speed = 0;
  const auto close = [&](std::size_t end) {
    if (end > begin + 1) {
      runs_.push_back(
          {points.subspan(begin, end - begin), std::span<const double>(s_mm_).subspan(begin, end - begin)});
    }
  };
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double speed = speed_mm_s(points[i]);
    bool breaks = speed < min_speed_mm_s || !std::isfinite(speed);
    if (i > begin && !breaks) {
      const auto &a = points[i - 1], &b = points[i];
      const double step = 0.5 * (speed + last_speed) * seconds(b.time - a.time);
      const bool reversed = a.vx_mm_s * b.vx_mm_s + a.vy_mm_s * b.vy_mm_s < 0;
      if (step > kHole || step < 0 || reversed) {
        close(i);
        begin = i;
      }
      s += std::clamp(step, 0.0, kHole);
    }
    if (breaks) {
      close(i);
      begin = i + 1;
    }
    s_mm_[i] = s;
    last_speed = speed;
  }
  close(points.size());
}

std::size_t index_at(const Run& run, double s_mm) {
  return static_cast<std::size_t>(std::lower_bound(run.s_mm.begin(), run.s_mm.end(), s_mm) -
                                  run.s_mm.begin());
}

Place place_at(const Run& run, double s_mm, int side, double clearance_mm) {
  Place place;
  int used = 0;
  const auto use = [&](std::size_t i) {
    const align::SurfacePoint& p = run.points[i];
    const double speed = speed_mm_s(p);
    if (p.code != 0 || speed <= 0) return;
    const double dx = static_cast<double>(p.vx_mm_s) / speed, dy = static_cast<double>(p.vy_mm_s) / speed;
    place.x_mm += static_cast<double>(p.x_mm) + dx * (s_mm - run.s_mm[i]);
    place.y_mm += static_cast<double>(p.y_mm) + dy * (s_mm - run.s_mm[i]);
    place.dir_x += dx;
    place.dir_y += dy;
    place.speed_mm_s += speed;
    ++used;
  };
  if (side > 0) {
    for (std::size_t i = index_at(run, s_mm + clearance_mm); i < run.points.size() && used < kPlacePoints;
         ++i)
      use(i);
  } else {
    for (std::size_t i = index_at(run, s_mm - clearance_mm); i > 0 && used < kPlacePoints; --i) use(i - 1);
  }
  if (used == 0) return place;
  const double length = std::hypot(place.dir_x, place.dir_y);
  place.x_mm /= used;
  place.y_mm /= used;
  place.speed_mm_s /= used;
  place.dir_x /= length;
  place.dir_y /= length;
  return place;
}

void append_path(const Run& run, std::span<const Stretch> hidden, double margin_mm,
                 std::vector<PathPiece>& out) {
  std::vector<Foot> feet;
  std::size_t next_hidden = 0;
  double last_valid = 0, last_kept = 0;
  for (std::size_t i = 0; i < run.points.size(); ++i) {
    const align::SurfacePoint& p = run.points[i];
    if (p.code != 0) continue;
    const double s = run.s_mm[i];
    while (next_hidden < hidden.size() && hidden[next_hidden].to_mm < s) ++next_hidden;
    const bool unseen = next_hidden < hidden.size() && hidden[next_hidden].from_mm <= s;
    if (unseen || (!feet.empty() && s - last_valid > kInvalidHole)) close_piece(feet, margin_mm, out);
    if (unseen) continue;
    last_valid = s;
    if (feet.empty() || s - last_kept >= kPathStep) {
      feet.push_back({s, static_cast<double>(p.x_mm), static_cast<double>(p.y_mm)});
      last_kept = s;
    }
  }
  close_piece(feet, margin_mm, out);
}

}  // namespace weldcell::edges
