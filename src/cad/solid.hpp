// One solid seen from above: its silhouette, its flat top and the round edges between. Open CASCADE stays
// behind this.
#pragma once

#include <TopoDS_Shape.hxx>
#include <string>

#include "weldcell/base/result.hpp"
#include "weldcell/geometry/plane.hpp"

namespace weldcell::cad {

struct SolidFromAbove {
  Polygon silhouette;         ///< counter-clockwise, mm
  double edge_radius_mm = 0;  ///< of the round edges along the long sides; 0 = sharp
  double bottom_mm = 0, top_mm = 0;
  int openings = 0;  ///< see-through holes inside the silhouette
};

/// Errors "cad.top" (no flat top), "cad.silhouette", "cad.limit"; `name` stands in them.
Result<SolidFromAbove> seen_from_above(const TopoDS_Shape& solid, const std::string& name);

}  // namespace weldcell::cad
