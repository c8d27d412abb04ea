// Where an outline, turned about its centroid, falls onto itself or nearly so. Pure; offline, milliseconds.
#pragma once

#include <vector>

#include "weldcell/workpiece/outline_template.hpp"

namespace weldcell::workpiece {

/// Rotations (identity excluded) whose image of the outline lies within kNearSymmetry_mm RMS of the outline;
/// edges match only when material lies on the same side. True symmetries first, then by gap; at most
/// kMaxSymmetries.
std::vector<Symmetry> find_symmetries(const OutlineTemplate& outline);

inline constexpr double kNearSymmetry_mm = 15.0;
inline constexpr double kTrueSymmetry_mm = 0.05;
inline constexpr std::size_t kMaxSymmetries = 8;

}  // namespace weldcell::workpiece
