// A DXF as plain curves in file units: blocks inserted, arcs and splines as short chords, each with its layer
// or block. Pure but for the file that it reads.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "weldcell/base/result.hpp"
#include "weldcell/geometry/plane.hpp"

namespace weldcell::cad {

struct Curve {
  int group = 0;  ///< curves of one group may make an outline together
  std::vector<Vec2> points;
  bool closed = false;
};

struct Drawing {
  int insunits = 0;  ///< $INSUNITS, 0 = absent or unitless
  std::vector<Curve> curves;
  std::vector<std::string> groups;      ///< name of each group: its block, or its layer
  std::map<std::string, int> left_out;  ///< kinds of entities that were not read, and how many
};

/// Errors "cad.unreadable", "cad.limit".
Result<Drawing> read_drawing(const std::string& path);

/// Points of an arc about c from angle a0 to a1 (rad, any direction), both ends included.
std::vector<Vec2> arc_points(const Vec2& c, double radius, double a0, double a1);
/// Points of the arc between two polyline vertices; bulge = tan(angle / 4), positive to the left. Without the
/// first point.
std::vector<Vec2> bulge_points(const Vec2& from, const Vec2& to, double bulge);
/// Points of a B-spline (weights all positive); empty when the knots do not fit.
std::vector<Vec2> spline_points(int degree, const std::vector<double>& knots,
                                const std::vector<Vec2>& control, const std::vector<double>& weights);

}  // namespace weldcell::cad
