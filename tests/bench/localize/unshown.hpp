// What a scan does not show, counted over the truth: no rule can do better.
#pragma once

#include "judge.hpp"

namespace weldcell::bench {

/// Whether the part could be other than drawn, in a way that a pass could show, without one crossing of this
/// scan being there or away: what no rule can tell, so that a good part must be sent back as well.
bool leaves_something_open(const PartUnderTest& part, const EdgeSet& set,
                           const localize::LocalizeOptions& options);

/// %, over the scans with seeds seed, seed + 1, ...
double share_left_open(const PartUnderTest& part, const Setting& setting, int trials, std::uint64_t seed);

}  // namespace weldcell::bench
