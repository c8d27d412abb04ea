// The robust method over ready crossings: search, polish, refinement, rivals, evidence, decision. Pure.
#pragma once

#include <span>
#include <vector>

#include "crossings.hpp"
#include "fields.hpp"
#include "weldcell/localize/localizer.hpp"

namespace weldcell::localize {

/// Fills the result and its verdict. `edges` are the points as given, `crossings` what is usable of them.
/// False when no pose of the range brings a single point near an edge.
bool solve_robust(const workpiece::OutlineTemplate& outline, const TemplateFields& fields,
                  const Crossings& crossings, std::span<const EdgePoint> edges,
                  std::span<const PathPiece> path, const LocalizeOptions& options, const StageDone& done,
                  Localization& result);

}  // namespace weldcell::localize
