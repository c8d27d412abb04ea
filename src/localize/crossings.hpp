// Edge points made ready for the fit: finite, distinct, with a direction into the material. Pure.
#pragma once

#include <span>
#include <vector>

#include "weldcell/localize/localize.hpp"

namespace weldcell::localize {

struct Crossing {
  Vec2 point = Vec2::Zero();      ///< frame Base
  Vec2 direction = Vec2::Zero();  ///< unit travel; zero when unknown
  Vec2 inward = Vec2::Zero();     ///< unit, towards rising ground along the travel; zero when unknown
  double inward_rad = 0;
  bool signed_step = false;  ///< inward is known
  double sigma_mm = 0.3;
  double speed_mm_s = 0;
  int source = 0;  ///< index of the edge point
};

struct Crossings {
  std::vector<Crossing> list;
  int broken = 0;           ///< points that were no numbers
  std::vector<bool> stray;  ///< one per edge point: off the path of the scan; empty when none is
};

/// Points that are not finite, or beyond kFarthest_mm, are dropped and counted; a point that stands twice
/// counts once; sigma outside [kMinSigma_mm, kMaxSigma_mm] is brought into it, unknown or negative sigma
/// becomes default_sigma_mm.
Crossings ready_crossings(std::span<const EdgePoint> edges, double default_sigma_mm);

/// A point of the scan farther than this from Base is no place in a cell, and counts as broken.
inline constexpr double kFarthest_mm = 1e5;
inline constexpr double kMinSigma_mm = 0.02;
inline constexpr double kMaxSigma_mm = 3.0;

}  // namespace weldcell::localize
