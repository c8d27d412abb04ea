// Whether what lies there is the part of the drawing: mirror image, place outside the range, members
// elsewhere or away. Pure.
#pragma once

#include <string>

#include "alternatives.hpp"
#include "decide.hpp"

namespace weldcell::localize {

/// Odds of about 1000 : 1.
inline constexpr double kAmbiguous_nats = 7;

/// Sets verdict, cause and reason, and true, when the points and the travel say that this is another part, or
/// that it lies outside what the job allows. `alternatives` may be null where there is no path.
bool wrong_part(const Situation& situation, const Alternatives* alternatives, Localization& result);

/// Whether a pose keeps the limits of the job, by its centroid or by its origin, with some slack.
bool within_limits(const Situation& situation, const Pose2& pose);

void say(Localization& result, Verdict verdict, const char* cause, std::string reason);
const std::string& member_name(const Situation& situation, int member);

}  // namespace weldcell::localize
