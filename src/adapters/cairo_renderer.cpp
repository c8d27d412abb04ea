#include "cairo_renderer.hpp"

#include <pango/pangocairo.h>

#include <algorithm>
#include <cmath>
#include <memory>

namespace weldcell::adapters {
namespace {

using guidance::Colour;

struct Rgb {
  double r, g, b;
};

// Full, well separated colours: a projector adds its light to that of the hall, so dark shades vanish on
// steel.
Rgb rgb(Colour colour) {
  switch (colour) {
    case Colour::Place:
      return {0.20, 1.00, 0.35};
    case Colour::Placed:
      return {0.45, 0.55, 0.65};
    case Colour::Fixture:
      return {1.00, 0.62, 0.05};
    case Colour::Warning:
      return {1.00, 0.22, 0.18};
    case Colour::Text:
      break;
  }
  return {1.00, 1.00, 1.00};
}

struct Unref {
  void operator()(PangoLayout* layout) const { g_object_unref(layout); }
  void operator()(PangoFontDescription* font) const { pango_font_description_free(font); }
};

void set_colour(cairo_t* cr, Colour colour, double alpha = 1) {
  const Rgb c = rgb(colour);
  cairo_set_source_rgba(cr, c.r, c.g, c.b, alpha);
}

bool finite(const Vec2& p) { return std::isfinite(p.x()) && std::isfinite(p.y()); }

void paint_line(cairo_t* cr, const guidance::PixelLine& line) {
  if (line.px.size() < 2 || !std::ranges::all_of(line.px, finite)) return;
  cairo_new_path(cr);
  for (const Vec2& p : line.px) cairo_line_to(cr, p.x(), p.y());
  if (line.closed) {
    cairo_close_path(cr);
    if (line.colour == Colour::Place || line.colour == Colour::Fixture) {
      // A faint body shows on which side of the outline the part lies.
      set_colour(cr, line.colour, 0.16);
      cairo_fill_preserve(cr);
    }
  }
  set_colour(cr, line.colour);
  cairo_set_line_width(cr, std::clamp(line.width_px, 1.0, 64.0));
  cairo_stroke(cr);
}

void paint_text(cairo_t* cr, const guidance::PixelText& text, int width_px) {
  if (text.text.empty() || !finite(text.px)) return;
  const std::unique_ptr<PangoLayout, Unref> layout(pango_cairo_create_layout(cr));
  const std::unique_ptr<PangoFontDescription, Unref> font(pango_font_description_from_string("Sans Bold"));
  pango_font_description_set_absolute_size(font.get(), std::clamp(text.height_px, 6.0, 400.0) * PANGO_SCALE);
  pango_layout_set_font_description(layout.get(), font.get());
  pango_layout_set_alignment(layout.get(), PANGO_ALIGN_CENTER);
  const std::unique_ptr<char, decltype(&g_free)> valid(
      g_utf8_make_valid(text.text.data(), static_cast<gssize>(text.text.size())), &g_free);
  pango_layout_set_text(layout.get(), valid.get(), -1);
  PangoRectangle ink;
  pango_layout_get_pixel_extents(layout.get(), &ink, nullptr);
  // Longer than the picture: wrapped at words rather than cut at both ends.
  const int room = width_px - 24;
  if (ink.width > room && room > 0) {
    pango_layout_set_width(layout.get(), room * PANGO_SCALE);
    pango_layout_set_wrap(layout.get(), PANGO_WRAP_WORD_CHAR);
    pango_layout_get_pixel_extents(layout.get(), &ink, nullptr);
  }
  double left = text.px.x() - ink.width / 2.0;
  left = std::clamp(left, 12.0, std::max(12.0, width_px - 12.0 - ink.width));
  const double top = text.px.y() - ink.height / 2.0;

  // A black rim keeps letters readable where they cross an outline.
  cairo_move_to(cr, left - ink.x, top - ink.y);
  pango_cairo_layout_path(cr, layout.get());
  cairo_set_source_rgb(cr, 0, 0, 0);
  cairo_set_line_width(cr, std::max(4.0, text.height_px / 5));
  cairo_stroke_preserve(cr);
  set_colour(cr, text.colour);
  cairo_fill(cr);
}

}  // namespace

void paint(cairo_t* cr, const guidance::Drawing& drawing, int width_px, int height_px) {
  cairo_save(cr);
  cairo_set_source_rgb(cr, 0, 0, 0);
  cairo_paint(cr);
  if (drawing.width_px > 0 && drawing.height_px > 0) {
    const double scale = std::min(static_cast<double>(width_px) / drawing.width_px,
                                  static_cast<double>(height_px) / drawing.height_px);
    cairo_translate(cr, (width_px - scale * drawing.width_px) / 2,
                    (height_px - scale * drawing.height_px) / 2);
    cairo_scale(cr, scale, scale);
    cairo_rectangle(cr, 0, 0, drawing.width_px, drawing.height_px);
    cairo_clip(cr);
    cairo_set_antialias(cr, CAIRO_ANTIALIAS_BEST);
    cairo_set_line_join(cr, CAIRO_LINE_JOIN_ROUND);
    cairo_set_line_cap(cr, CAIRO_LINE_CAP_ROUND);
    for (const guidance::PixelLine& line : drawing.lines) paint_line(cr, line);
    for (const guidance::PixelText& text : drawing.texts) paint_text(cr, text, drawing.width_px);
  }
  cairo_restore(cr);
}

}  // namespace weldcell::adapters
