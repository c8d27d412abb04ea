// Which member is off by more than the drawing's tolerance, and in what way: each possibility weighed by its
// evidence. Pure.
#pragma once

#include <vector>

#include "normal_equations.hpp"

namespace weldcell::localize {

/// One member off in one way, the rest as drawn or as given.
struct Hypothesis {
  Freed freed;
  double nats = 0;       ///< log-evidence less the odds
  double odds_nats = 0;  ///< against the member's being off in this way, before the points speak
};

/// Too few members do not tell in what one of them is off: there they are free altogether or not at all.
bool few(const Freedoms& freedoms);

/// Each of the members off in each way. The latencies are the sigmas of the priors that stand side by side.
std::vector<Hypothesis> hypotheses(const NormalEquations& equations, const Freedoms& rest,
                                   const std::vector<std::size_t>& members,
                                   const std::vector<double>& latencies_ms);

/// Of each of `count` members over the ways in which it may be off; -1e300 where none was weighed.
std::vector<double> sum_by_member(const std::vector<Hypothesis>& all, std::size_t count);
std::size_t likeliest(const std::vector<double>& nats);

/// Of the members that are held, at most three that strain most against a tenth of the drawing's tolerance,
/// those first; none that noise alone would strain so.
std::vector<std::size_t> most_strained(const NormalEquations& equations, const Priors& priors,
                                       const Freedoms& freedoms);

/// The one member that is free, and the three whose freedom instead of its own explains the points best.
std::vector<std::size_t> with_the_likeliest_instead(const NormalEquations& equations,
                                                    const Freedoms& freedoms,
                                                    const std::vector<double>& latencies_ms);

}  // namespace weldcell::localize
