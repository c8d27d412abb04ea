// How well another drawing - one member elsewhere, or none at all - explains the scan, against the drawing as
// it is. Pure.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "evidence.hpp"
#include "fit.hpp"
#include "weldcell/localize/localize.hpp"

namespace weldcell::localize {

/// One member away from its drawn place.
struct Displacement {
  int member = -1;
  Vec2 shift = Vec2::Zero();  ///< frame Part, mm
  int own_points = 0;         ///< otherwise unexplained points that lie on the member there
  double gain_nats = -1e300;  ///< log-likelihood over the drawing as it is
};

/// Log-likelihood ratios from points and travel together: a point on a visible edge against clutter spread
/// evenly over the travel, a crossing that should have been seen and was not. Every alternative is drawn anew
/// around the member: what it covers there is hidden, what it leaves bare is an edge.
class Alternatives {
 public:
  Alternatives(const workpiece::OutlineTemplate& outline, const std::vector<Crossing>& crossings,
               std::span<const PathPiece> path, const Fit& fit, const Evidence& evidence);

  /// The best displacement of the member between kLeast_mm and kMost_mm: along its sides' normals, and along
  /// two of them at once when `anywhere`.
  Displacement displaced(int member, bool anywhere) const;
  /// Logarithm of how many displacements of one member the points could tell apart: so much a best one gains
  /// by having been looked for.
  double places_nats() const;
  /// Log-likelihood of a part without the member over the drawing as it is, nats.
  double missing(int member) const;

  /// Whether the scan prefers the drawing as it is, by this many nats or more, to a part that has this
  /// outline instead of the member's and differs within the box only.
  bool refutes(std::size_t member, const Polygon& instead, const Box2& within, double nats) const;
  /// What any other outline may gain at most that differs within the box only: all that is unexplained there
  /// explained, and nothing left unseen.
  double most_gain(const Box2& within) const;
  /// The members' outlines where the fit has them, frame Part.
  const std::vector<Polygon>& members() const { return members_; }

  /// Log-likelihood of the points alone, with the members where the fit has them, up to what all fits of the
  /// same crossings share, nats. Sides that a member pulled off its joint lays bare count as edges here, but
  /// nobody has to have seen them: a narrow slot hides both of its sides.
  double whole() const;

  static constexpr double kLeast_mm = 4, kMost_mm = 60;

  /// Of the template: sides closer than this to another member hide in a joint.
  static constexpr double kJointGap_mm = 0.5;

 private:
  /// A point this close to an edge lies on it: noise, and members that are a little off.
  static constexpr double kOnEdge_mm = 1.5;
  /// A side tells nothing about a step against it, nor along it.
  static constexpr double kAgainst = -0.15;
  /// A crossing more along an edge than this may be missed.
  static constexpr double kMinAcross = 0.35;

  struct Spot {
    Vec2 place, inward;                   ///< frame Part
    bool directed = false, free = false;  ///< free: no edge of the drawing claims it
  };
  struct Piece {
    Vec2 from, to;
  };
  struct Vote {
    Vec2 axis;
    double by_mm = 0;
    int points = 0;
  };
  /// The part as fitted, or with another outline instead of one member's.
  struct Variant {
    std::size_t member = 0;
    const Polygon* outline = nullptr;  ///< empty: without the member
    Box2 box;
  };
  /// What lies within reach of one member.
  struct Region {
    Box2 box;
    std::vector<Spot> spots;  ///< by x
    std::vector<Piece> pieces;
    double joint_gap_mm = kJointGap_mm;  ///< sides closer than this to another member hide in a joint
    double end_margin_mm = 3;            ///< crossings nearer to an edge's end are not promised
    double drawn_nats = 0;               ///< score of the drawing as it is
    /// Members at anything of it, spot or travel, in order: the others neither show nor hide anything there.
    std::vector<std::size_t> near;
  };

  /// Where a member may show, displaced or not.
  Box2 reach_of(std::size_t member) const;
  bool holds_free(const Box2& box) const;
  Region around(std::size_t member) const;
  Region inside(const Box2& box) const;
  Region everywhere() const;
  /// Notes which members are near, and the given one in any case.
  void note_near(std::size_t member, Region& region) const;
  /// The first of spots_ at x or beyond.
  std::vector<Spot>::const_iterator first_from(double x) const;
  const Polygon& outline_of(const Variant& part, std::size_t member) const {
    return part.outline != nullptr && part.member == member ? *part.outline : members_[member];
  }
  const Box2& box_of(const Variant& part, std::size_t member) const {
    return part.outline != nullptr && part.member == member ? part.box : boxes_[member];
  }
  /// Whether anything of the region, spot or travel, is at what lies within a box.
  static bool touched(const Box2& box, const Region& region);
  /// The edges at spots and travel of the region; elsewhere they may lack cuts, or be missing.
  std::vector<workpiece::VisibleEdge> edges_within(const Variant& part, const Region& region) const;
  /// All edges that a member shows on the drawing as fitted.
  const std::vector<workpiece::VisibleEdge>& drawn(std::size_t member, double joint_gap_mm) const;
  /// The edges that a member shows at spots and travel of the region; elsewhere they may lack cuts.
  std::vector<workpiece::VisibleEdge> visible(const Variant& part, std::size_t member,
                                              const Region& region) const;
  double explained_nats(const std::vector<workpiece::VisibleEdge>& edges, const Region& region) const;
  double score(const Variant& part, const Region& region) const;
  /// What `score` has credited to a variant for closing slots of the drawing that may be too narrow to be
  /// seen.
  double slots_nats(const Variant& part, Region region) const;
  int unseen_on(const std::vector<workpiece::VisibleEdge>& edges, const Region& region) const;
  std::vector<Vote> votes(const Polygon& outline, const Region& region, bool loosely) const;
  void displaced_from(const Polygon& outline, bool anywhere, Region& region, Displacement& best) const;
  int bared_by(std::size_t member, const Region& region) const;

  std::vector<Polygon> outlines_;  ///< as drawn, frame Part
  std::vector<Polygon> members_;   ///< where the fit has them, frame Part
  std::vector<Box2> boxes_;        ///< of members_
  /// What `drawn` has found, by joint gap: not for more than one thread.
  mutable std::map<double, std::vector<std::optional<std::vector<workpiece::VisibleEdge>>>> drawn_;
  std::vector<Spot> spots_;  ///< by x
  std::vector<Piece> pieces_;
  std::vector<int> unseen_;  ///< crossings of each member that were expected and not seen
  double point_nats_ = 6, unseen_nats_ = 3;
};

}  // namespace weldcell::localize
