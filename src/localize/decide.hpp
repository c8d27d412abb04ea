// From fit and evidence to weld, rescan or reject, with a cause and one action. Pure.
#pragma once

#include <span>
#include <vector>

#include "evidence.hpp"
#include "fit.hpp"
#include "weldcell/localize/localize.hpp"

namespace weldcell::localize {

/// A competing pose that the data may not tell apart.
struct Rival {
  Fit fit;
  double gap_nats = 0;  ///< log-likelihood of the found pose over this one, evidence of the path included
  bool turned = false;  ///< a near-symmetry of the part
};

struct Situation {
  const workpiece::OutlineTemplate& outline;
  const TemplateFields& fields;
  const LocalizeOptions& options;
  const std::vector<Crossing>& crossings;
  std::span<const PathPiece> path;
  const Fit& fit;
  const Evidence& evidence;
  const std::vector<Rival>& rivals;
};

/// Two sigmas at most of how far two members are shifted against each other: beyond max_member_shift_mm and
/// this a part is refused whichever of them is off.
inline constexpr double kEitherSlack_mm = 1;

/// Sets verdict, cause and reason of the result, whose figures are already filled.
void decide(const Situation& situation, Localization& result);

/// Log-likelihood of expected crossings not seen, nats.
double path_log_likelihood(const Evidence& evidence);

}  // namespace weldcell::localize
