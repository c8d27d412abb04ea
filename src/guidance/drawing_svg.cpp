#include <fmt/format.h>

#include "weldcell/base/markup.hpp"
#include "weldcell/guidance/drawing.hpp"

namespace weldcell::guidance {

namespace {

/// The projector's own colours: bright on black, since black is no light.
const char* css(Colour colour) {
  switch (colour) {
    case Colour::Place:
      return "#3dff6e";
    case Colour::Placed:
      return "#6f9a7b";
    case Colour::Fixture:
      return "#ffd23d";
    case Colour::Text:
      return "#ffffff";
    case Colour::Warning:
      return "#ff8a5c";
  }
  return "#ffffff";
}

}  // namespace

std::string drawing_svg(const Drawing& drawing) {
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" "
      "role=\"img\">",
      drawing.width_px, drawing.height_px);
  out += "<title>";
  for (const PixelText& t : drawing.texts) out += escaped(t.text) + ". ";
  out += "</title>";
  out +=
      fmt::format("<rect width=\"{}\" height=\"{}\" fill=\"#000000\"/>", drawing.width_px, drawing.height_px);
  for (const PixelLine& line : drawing.lines) {
    out += line.closed ? "<polygon points=\"" : "<polyline points=\"";
    for (const Vec2& p : line.px) out += fmt::format("{:.1f},{:.1f} ", p.x(), p.y());
    if (!line.px.empty()) out.pop_back();
    out += fmt::format("\" fill=\"none\" stroke=\"{}\" stroke-width=\"{:g}\" stroke-linejoin=\"round\"/>",
                       css(line.colour), line.width_px);
  }
  for (const PixelText& t : drawing.texts) {
    out += fmt::format(
        // As a style: a page's rule for text must not make it dark on the black ground.
        "<text x=\"{:.1f}\" y=\"{:.1f}\" style=\"font:bold {:.1f}px sans-serif;fill:{};text-anchor:middle;"
        "dominant-baseline:central\">{}</text>",
        t.px.x(), t.px.y(), t.height_px, css(t.colour), escaped(t.text));
  }
  return out + "</svg>";
}

}  // namespace weldcell::guidance
