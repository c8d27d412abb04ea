// What the laser can see of a workpiece from above: oriented visible edges, built once from the members.
// Pure.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "weldcell/geometry/plane.hpp"
#include "weldcell/workpiece/workpiece.hpp"

namespace weldcell::workpiece {

/// A height step on the boundary of the union of all members. Frame Part, mm.
struct VisibleEdge {
  Segment line;          ///< material to the left of a -> b
  Vec2 outward;          ///< unit normal, from material to table
  int member = -1;       ///< index into Workpiece::members
  int side = -1;         ///< index of the outline side (vertex i -> i+1) of that member
  bool round = false;    ///< the member's round top edge runs along it
  double radius_mm = 0;  ///< of that edge
};

/// Symmetry or near-symmetry of the outline under a rotation about the centroid (plus the shift that fits
/// best).
struct Symmetry {
  Pose2 map;          ///< frame Part -> frame Part
  double gap_mm = 0;  ///< RMS distance between the outline and its image; 0 = a true symmetry
};

struct OutlineTemplate {
  std::string name;
  std::vector<std::string> member_names;
  std::vector<VisibleEdge> edges;
  std::vector<Polygon> members;      ///< outlines as in the workpiece
  std::vector<Symmetry> symmetries;  ///< identity excluded; true ones first, then by gap
  Vec2 centroid = Vec2::Zero();      ///< of the visible edges, by length; errors are stated here
  double radius_mm = 0;              ///< farthest visible point from the centroid
  double height_mm = 0;
};

/// Sides hidden in joints (closer than joint_gap_mm to another member's side, or inside another member) are
/// no edges. Errors: "template.empty" when nothing is visible.
Result<OutlineTemplate> build_template(const Workpiece& workpiece, double joint_gap_mm = 0.5);

/// The edges of one member that show beside the others: its sides less what other outlines cover or touch
/// within joint_gap_mm. An empty outline stands for a member that is not there. VisibleEdge::round stays
/// false.
std::vector<VisibleEdge> visible_edges(std::span<const Polygon> members, std::size_t member,
                                       double joint_gap_mm = 0.5);

}  // namespace weldcell::workpiece
