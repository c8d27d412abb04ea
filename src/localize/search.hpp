// Exhaustive search over turn and shift on the score grids: the few poses worth a polish. Pure.
#pragma once

#include <vector>

#include "crossings.hpp"
#include "fields.hpp"

namespace weldcell::localize {

/// Where the template's centroid lies in Base, and the turn of the part.
struct CentredPose {
  Vec2 centre = Vec2::Zero();
  double theta_rad = 0;
};

struct SearchBox {
  CentredPose planned;
  double range_mm = 50;  ///< each axis of Base, for the centroid or for the part's origin
  double range_rad = 0.35;
  Vec2 origin = Vec2::Zero();  ///< the part's origin seen from the centroid, frame Part

  /// Whether centroid or origin keep the range, with some slack.
  bool holds(const CentredPose& pose, double slack_mm, double slack_rad) const;
};

struct Mode {
  CentredPose pose;
  double score = 0;  ///< 0..1, mean over the points used
};

/// At most max_modes distinct poses, best first. Uses an even sample of at most kSearchPoints crossings.
std::vector<Mode> search(const TemplateFields& fields, const std::vector<Crossing>& crossings,
                         const SearchBox& box, std::size_t max_modes);

/// An even sample over the plane, at most `count`, in a fixed order.
std::vector<Crossing> sampled(const std::vector<Crossing>& crossings, std::size_t count);

inline constexpr std::size_t kSearchPoints = 72;

}  // namespace weldcell::localize
