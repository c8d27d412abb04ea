#include "cad/weldment.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "cad/outline.hpp"
#include "weldcell/geometry/boxes.hpp"

namespace weldcell::cad {

namespace {

constexpr double kContactGapMm = 0.5;
constexpr double kMinSeamMm = 5;
constexpr double kMaxOverlapMm = 1;
constexpr double kToleranceMm = 0.6;

workpiece::Weld weld_along(const std::vector<Vec2>& line, double z_mm) {
  workpiece::Weld weld;
  const auto lifted = [&](const Vec2& p) { return Eigen::Vector3d(p.x(), p.y(), z_mm); };
  weld.start = lifted(line.front());
  for (std::size_t i = 1; i < line.size(); ++i) {
    workpiece::SeamPiece piece;
    piece.to = lifted(line[i]);
    weld.pieces.push_back(piece);
  }
  weld.tolerance_mm = kToleranceMm;
  return weld;
}

}  // namespace

double mm_per_unit(const std::string& units) {
  if (units == "mm") return 1;
  if (units == "inch") return 25.4;
  return units == "m" ? 1000 : 0;
}

Status check_extent(const CadPart& part, bool inch) {
  Box2 all = bounds(part.members.front().outline);
  for (const workpiece::Member& m : part.members) all = united(all, bounds(m.outline));
  const double extent = (all.max - all.min).maxCoeff();
  const std::string size =
      fmt::format("comes out {:.4g} x {:.4g} mm", all.max.x() - all.min.x(), all.max.y() - all.min.y());
  if (inch && extent > kMaxUnaskedInchMm) {
    return fault("cad.units", "declares inches and " + size,
                 "say --units mm if its numbers are millimetres, --units inch if it is as big as that");
  }
  if (extent > kMaxExtentMm || extent < kMinExtentMm) {
    return fault("cad.units", fmt::format("{}, {:g} to {:g} is expected", size, kMinExtentMm, kMaxExtentMm),
                 "wrong units? say --units mm, inch or m");
  }
  return Done{};
}

Result<workpiece::Workpiece> make_workpiece(const CadPart& part, const std::string& name) {
  workpiece::Workpiece out;
  out.name = name;
  out.height_mm = part.height_mm;
  out.members = part.members;
  for (std::size_t i = 0; i < out.members.size(); ++i) out.members[i].tag = std::to_string(i + 1);
  for (std::size_t i = 0; i < out.members.size(); ++i) {
    for (std::size_t k = i + 1; k < out.members.size(); ++k) {
      const workpiece::Member &a = out.members[i], &b = out.members[k];
      const double depth = overlap_depth(a.outline, b.outline);
      if (depth > kMaxOverlapMm) {
        return fault("cad.overlap",
                     fmt::format("'{}' and '{}' lie {:.1f} mm deep on each other seen from above", a.name,
                                 b.name, depth),
                     "weldcell places members side by side; export only those, or check the drawing");
      }
      for (const std::vector<Vec2>& line : contact_lines(a.outline, b.outline, kContactGapMm, kMinSeamMm)) {
        workpiece::Weld weld = weld_along(line, out.height_mm);
        weld.name = "w" + std::to_string(out.welds.size() + 1);
        weld.joins = {a.name, b.name};
        out.welds.push_back(std::move(weld));
      }
    }
  }
  return workpiece::validated(std::move(out));
}

}  // namespace weldcell::cad
