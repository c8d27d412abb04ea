// What a CAD file gives: members as outlines seen from above, the height, and what was left out. Pure.
#pragma once

#include <string>
#include <vector>

#include "weldcell/base/result.hpp"
#include "weldcell/workpiece/workpiece.hpp"

namespace weldcell::cad {

/// Plane of the CAD file that lies on the table.
enum class Plane { Xy, Xz, Yz };
/// Which line a DXF draws of a section with round edges.
enum class Drawn { Unsaid, Silhouette, Flat };

struct Options {
  std::string units;  ///< "" = as the file says; mm | inch | m
  Plane plane = Plane::Xy;
  double height_mm = 0;       ///< needed for DXF
  double edge_radius_mm = 0;  ///< DXF: round top edges along the members' long sides
  Drawn drawn = Drawn::Unsaid;
};

struct CadPart {
  double height_mm = 0;
  std::vector<workpiece::Member> members;  ///< tags not yet set
  std::vector<std::string> notes;          ///< what was assumed or left out, one line each
};

/// Bounds that keep a wrong or hostile file from costing more than a refusal.
inline constexpr std::size_t kMaxMembers = 200;
inline constexpr std::size_t kMaxVertices = 1000;  ///< of one outline
inline constexpr double kMaxExtentMm = 10'000;
inline constexpr double kMinExtentMm = 5;
inline constexpr double kMaxUnaskedInchMm =
    3'000;  ///< a file in inches that is longer must be confirmed by --units

/// Errors "cad.*": unreadable, units, without a flat top, no solid, tops at different heights, limits.
Result<CadPart> read_step(const std::string& path, const Options& options);
/// Errors "cad.*": unreadable, units, height, no closed outline, branches, limits.
Result<CadPart> read_dxf(const std::string& path, const Options& options);

/// mm of one unit; 0 for a word that is none of mm, inch, m.
double mm_per_unit(const std::string& units);
/// Refuses what is absurdly big or small for a weldment; `inch` = the file, not the user, says inch.
Status check_extent(const CadPart& part, bool inch);

inline Error fault(const char* code, std::string what, std::string mend) {
  return {code, "", std::move(what), std::move(mend)};
}

}  // namespace weldcell::cad
