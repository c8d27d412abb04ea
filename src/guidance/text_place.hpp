// Finds room in the picture for a text: near where it is wanted, off lines, members and other texts. Pure.
#pragma once

#include <string>
#include <vector>

#include "weldcell/guidance/drawing.hpp"

namespace weldcell::guidance {

class TextPlace {
 public:
  TextPlace(double width_px, double height_px, const std::vector<PixelLine>& lines)
      : width_(width_px), height_(height_px), lines_(lines) {}

  /// No text over this area (pixels, closed polygon).
  void keep_off(const std::vector<Vec2>& area) { areas_.push_back(area); }

  /// The text at the free place closest to `wanted`; where nothing is free, as close as the picture's borders
  /// allow.
  PixelText put(const std::string& text, const Vec2& wanted, double height_px, Colour colour);

 private:
  bool free(const Box2& box) const;
  double width_, height_;
  std::vector<PixelLine> lines_;
  std::vector<std::vector<Vec2>> areas_;
  std::vector<Box2> texts_;
};

}  // namespace weldcell::guidance
