// Paints a guidance drawing with Cairo and Pango; what PNG and window share. Private; one thread at a time.
#pragma once

#include <cairo.h>

#include "weldcell/guidance/drawing.hpp"

namespace weldcell::adapters {

/// Fills the target's size with black and paints the drawing, scaled to fit and centred; scale 1 when the
/// sizes are equal.
void paint(cairo_t* target, const guidance::Drawing& drawing, int width_px, int height_px);

}  // namespace weldcell::adapters
