// An SVG figure of the table seen from above: frame Base, +X right, +Y up, same scale on both axes. Pure.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "weldcell/geometry/plane.hpp"

namespace weldcell::review {

class PlaneSvg {
 public:
  /// `view` in mm; the picture is at most 1080 px wide and 640 px high. `id` is unique on the page.
  PlaneSvg(const Box2& view, std::string id, std::string title, std::string description);

  // `style` is a class list of the page's style sheet. Points that are not finite are left out.
  void polygon(const Polygon& mm, std::string_view style);
  void line(const std::vector<Vec2>& mm, std::string_view style);
  /// Many dots of one style as one element.
  void dots(const std::vector<Vec2>& mm, std::string_view style);
  /// Many short strokes of one style as one element.
  void strokes(const std::vector<Segment>& mm, std::string_view style);
  /// Centred at the point, `dx_px`, `dy_px` beside it.
  void text(const Vec2& mm, std::string_view text, std::string_view style, double dx_px = 0,
            double dy_px = 0);
  /// Number in a filled circle.
  void marker(const Vec2& mm, std::string_view text, std::string_view style);
  void arrow(const Vec2& from_mm, const Vec2& to_mm, std::string_view style);

  double mm_per_px() const { return 1 / scale_; }
  const Box2& view() const { return view_; }
  /// The whole element: ground, grid with its numbers, what was drawn.
  std::string finish() const;

 private:
  std::string at(const Vec2& mm) const;
  Vec2 px(const Vec2& mm) const;
  std::string grid() const;

  Box2 view_;
  std::string id_, title_, description_;
  double scale_ = 1, width_px_ = 0, height_px_ = 0;
  std::string body_;
};

/// Smallest of 1, 2, 5 times a power of ten that is at least `least`.
double round_step(double least);

}  // namespace weldcell::review
