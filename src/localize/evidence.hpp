// What the scan should have crossed and did not, and what it crossed that the drawing does not have. Pure.
#pragma once

#include <span>
#include <vector>

#include "crossings.hpp"
#include "fields.hpp"
#include "fit.hpp"

namespace weldcell::localize {

struct Expected {
  int edge = -1;
  double along_mm = 0;  ///< place on the edge
  bool seen = false;
};

struct MemberEvidence {
  int expected = 0, seen = 0;
  int exposed = 0;  ///< points on sides that a joint with this member should hide
};

struct Evidence {
  bool has_path = false;
  std::vector<Expected> crossings;
  std::vector<MemberEvidence> members;
  int expected = 0, seen = 0;
  /// Share of expected crossings seen, members without any left out; 1 without a path.
  double rate = 1;
  int exposed = 0;
  double exposed_by_chance = 0;  ///< points that clutter alone would put on hidden sides
  std::vector<int> hides;        ///< one per crossing: the member whose joint should hide it; -1 = none
};

/// Pieces of the path against the template's edges at the found pose. Grazing crossings and those near an
/// edge's end are left out: nobody can promise them.
Evidence gather_evidence(const TemplateFields& fields, std::span<const PathPiece> path, const Fit& fit);
/// Adds the points on sides hidden in joints.
void add_exposed(const workpiece::OutlineTemplate& outline, const std::vector<Crossing>& crossings,
                 const Fit& fit, Evidence& evidence);

/// Members that the scan crossed often enough and hardly saw (chance below 1e-4 at the rate of the other
/// members).
std::vector<int> unseen_members(const Evidence& evidence);

/// A member at another place explains points that nothing else explains.
struct Displacement {
  int member = -1;
  Vec2 shift = Vec2::Zero();  ///< frame Part, mm
  int explained = 0;          ///< points
  double gain = 0;            ///< nats over the member at its drawn place
};
/// The best displacement of one member up to kDisplacement_mm: along and across its sides, or anywhere.
Displacement find_displacement(const workpiece::OutlineTemplate& outline, const TemplateFields& fields,
                               std::span<const PathPiece> path, const std::vector<Crossing>& crossings,
                               const Fit& fit, const Evidence& evidence, int member, bool anywhere);

inline constexpr double kDisplacement_mm = 60;

}  // namespace weldcell::localize
