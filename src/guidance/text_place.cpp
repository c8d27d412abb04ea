#include "text_place.hpp"

#include <algorithm>

#include "lens.hpp"
#include "weldcell/geometry/boxes.hpp"

namespace weldcell::guidance {

namespace {

constexpr double kAspect = 0.62;  // width of a character against the height of the text
constexpr double kMarginPx = 6;
constexpr double kGridPx = 8;

bool touches(const Box2& box, Vec2 a, Vec2 b) {
  a -= box.min;
  b -= box.min;
  return clip(a, b, box.max.x() - box.min.x(), box.max.y() - box.min.y());
}

}  // namespace

bool TextPlace::free(const Box2& box) const {
  for (const PixelLine& line : lines_) {
    for (std::size_t i = 1; i < line.px.size(); ++i) {
      if (touches(box, line.px[i - 1], line.px[i])) return false;
    }
    if (line.closed && touches(box, line.px.back(), line.px.front())) return false;
  }
  for (const std::vector<Vec2>& area : areas_) {
    if (contains(area, (box.min + box.max) / 2)) return false;
    for (std::size_t i = 0; i < area.size(); ++i) {
      if (touches(box, area[i], area[(i + 1) % area.size()])) return false;
    }
  }
  return std::none_of(texts_.begin(), texts_.end(), [&](const Box2& t) { return !apart(box, t); });
}

PixelText TextPlace::put(const std::string& text, const Vec2& wanted, double height_px, Colour colour) {
  const double room = width_ - 2 * kMarginPx;
  const double natural = kAspect * height_px * static_cast<double>(std::max<std::size_t>(1, text.size()));
  const double size = natural > room ? height_px * room / natural : height_px;
  const Vec2 half(std::min(natural, room) / 2 + kMarginPx / 2, size / 2 + kMarginPx / 2);
  const Vec2 low = half, high = Vec2(width_, height_) - half;
  const Vec2 home = wanted.cwiseMax(low).cwiseMin(high.cwiseMax(low));
  Vec2 best = home;
  double best_distance = -1;
  const auto consider = [&](const Vec2& c) {
    const double d = (c - wanted).norm();
    if ((best_distance < 0 || d < best_distance) && free({c - half, c + half})) {
      best = c;
      best_distance = d;
    }
  };
  consider(home);
  for (double y = low.y(); y <= high.y(); y += kGridPx) {
    for (double x = low.x(); x <= high.x(); x += kGridPx) consider({x, y});
  }
  texts_.push_back({best - half, best + half});
  return {best, text, size, colour};
}

}  // namespace weldcell::guidance
