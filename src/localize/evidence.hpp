// What the scan should have crossed, and which of it was seen. Pure.
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
};

struct Evidence {
  bool has_path = false;
  std::vector<Expected> crossings;
  std::vector<MemberEvidence> members;
  int expected = 0, seen = 0;
  /// Share of expected crossings seen, members without any left out; 1 without a path.
  double rate = 1;
};

/// Pieces of the path against the template's edges at the found pose. Grazing crossings and those near an
/// edge's end are left out: nobody can promise them.
Evidence gather_evidence(const TemplateFields& fields, std::span<const PathPiece> path, const Fit& fit);
/// Members that the scan crossed often enough and hardly saw (chance below 1e-4 at the rate of the other
/// members).
std::vector<int> unseen_members(const Evidence& evidence);

}  // namespace weldcell::localize
