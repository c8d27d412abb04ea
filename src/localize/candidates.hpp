// Poses that the search finds, polished, with the images and slips that it may have missed. Pure.
#pragma once

#include <functional>
#include <vector>

#include "fit.hpp"
#include "search.hpp"
#include "weldcell/localize/localizer.hpp"

namespace weldcell::localize {

/// Beyond this a second mode need not be looked at more closely.
inline constexpr double kFarBehind_nats = 40;

struct Candidate {
  FitState state;
  double likelihood = 0;  ///< rough_log_likelihood, nats
  bool turned = false;    ///< a near-symmetric image of another one
};

Pose2 part_pose(const workpiece::OutlineTemplate& outline, const CentredPose& centred);
CentredPose centred_pose(const workpiece::OutlineTemplate& outline, const Pose2& pose);
/// Whether a fit from either ends in the same basin.
bool same_place(const TemplateFields& fields, const CentredPose& a, const CentredPose& b);

/// Distinct polished poses by likelihood on these crossings, the best one first; none when no pose of the box
/// brings a single point near an edge. `searched` is called once the search is done; `iterations` are added
/// to.
std::vector<Candidate> collect_candidates(const workpiece::OutlineTemplate& outline,
                                          const TemplateFields& fields, const SearchBox& box,
                                          const std::vector<Crossing>& crossings,
                                          const std::function<void()>& searched, int& iterations);

}  // namespace weldcell::localize
