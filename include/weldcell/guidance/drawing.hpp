// What the projector shows: steps (member, fixtures) and drawings in projector pixels. Pure; no device, no
// Cairo.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "weldcell/cell/cell_setup.hpp"
#include "weldcell/workpiece/workpiece.hpp"

namespace weldcell::guidance {

/// One thing that the worker does: place this member against these magnets.
struct GuideStep {
  int member = 0;                      ///< index into Workpiece::members
  std::string title;                   ///< "Place member 3: rung_1"
  Vec2 centre_base_mm = Vec2::Zero();  ///< where the projector looks
  double heading_rad = 0;
  std::vector<workpiece::Fixture> fixtures;  ///< frame Part
};

/// Fixtures of the workpiece, or computed ones: cylinders that touch the member's outer boundary and nothing
/// else, at least two along its axis.
std::vector<workpiece::Fixture> place_fixtures(const workpiece::Workpiece& workpiece);
/// One step a member, in the order of the drawing.
std::vector<GuideStep> guide_steps(const workpiece::Workpiece& workpiece, const Pose2& planned);

enum class Colour : std::uint8_t { Place, Placed, Fixture, Text, Warning };

struct PixelLine {
  std::vector<Vec2> px;  ///< polyline in picture pixels
  bool closed = false;
  double width_px = 3;
  Colour colour = Colour::Place;
};
struct PixelText {
  Vec2 px = Vec2::Zero();  ///< centre of the text
  std::string text;
  double height_px = 28;
  Colour colour = Colour::Text;
};
/// A picture in projector pixels, device-independent.
struct Drawing {
  int width_px = 0, height_px = 0;
  std::vector<PixelLine> lines;
  std::vector<PixelText> texts;
};

/// The drawing as an SVG element of its own size, black ground, for pages; texts escaped.
std::string drawing_svg(const Drawing& drawing);

/// Projects the step (outline and number of the member, those already placed, fixtures) through the
/// projector's lens model from its pose. Parts outside the picture are clipped and named in a text.
Drawing draw_step(const cell::CellSetup& cell, const workpiece::Workpiece& workpiece, const Pose2& planned,
                  const std::vector<GuideStep>& steps, std::size_t current,
                  const Transform<Base, Projector>& T_base_projector);

}  // namespace weldcell::guidance
