// How a part may differ from its drawing by one side or one member's direction, and where a straight pass of
// the beam would tell. Pure.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "weldcell/workpiece/outline_template.hpp"

namespace weldcell::workpiece {

/// One member other than drawn: a side moved along its normal (longer, shorter, wider, narrower), the member
/// shifted along itself, turned about one of its ends, or put in its place turned over.
struct Departure {
  int member = -1;
  int side = -1;       ///< the side that moves, of a shift the end that it moves away from; -1: turned, over
  bool whole = false;  ///< the member is shifted
  bool over = false;   ///< turned over about its axis, end for end, or both
  bool end = false;    ///< an end of the member: the side runs across its longest one
  Vec2 outward{0, 0};  ///< unit; of the side, or of the end that swings
  Polygon instead;     ///< the member's outline then, frame Part
  Box2 reach;          ///< what is other than drawn lies in here
};

/// All departures of one member by by_mm (at the swinging end of a turn), turned over ones included;
/// `visible` are the visible edges of the part as drawn. Ends in the open move only with their member unless
/// free_ends: a longer or shorter one changes no joint. Left out are sides shorter than 8 mm, what would
/// leave less than half of the member, and sides that would move out through a joint that hides most of them:
/// there another member is.
std::vector<Departure> departures(std::span<const Polygon> members, std::span<const VisibleEdge> visible,
                                  std::size_t member, double by_mm, bool free_ends);

/// The member turned over about the middle of its length, of its width, and of both, each in the place where
/// it is; those that leave the outline as it is to 5 mm are left out, of two that are alike one.
std::vector<Departure> turned_over(std::span<const Polygon> members, std::size_t member);

/// One member shifted as it is, by that much, frame Part: once for each side that would move, the farthest
/// first.
std::vector<Departure> shifts(std::span<const Polygon> members, std::size_t member, const Vec2& by_mm);

/// Whether a side of the outline is an end: it runs across the longest one.
bool is_end(const Polygon& outline, std::size_t side);

/// How many crossings on a straight pass tell the two outlines apart: edges that only the one has there.
/// Crossings that graze an edge, or lie within 3 mm of its end, count for nothing; edges of the same side
/// within 5 mm count as one.
int crossings_that_tell(std::span<const VisibleEdge> drawn, std::span<const VisibleEdge> instead,
                        const Segment& pass);

/// The pass, frame Part, that tells the departure from the drawing by at least two crossings: square across
/// the side, where there is most room to both sides, or across both sides of the end that swings, with room
/// before the first edge and behind the last. Nothing when from above both are one part, as where an end
/// grows into a joint or leaves a slot of less than 2 mm.
std::optional<Segment> telling_pass(std::span<const Polygon> members, const Departure& departure);

/// The fewest passes of that kind, three at most, that beside the passes already laid tell the departure from
/// the drawing wherever the part lies within off_mm, in x and in y, of where it is expected. None when those
/// laid do, or when nobody can tell.
std::vector<Segment> settling_passes(std::span<const Polygon> members, const Departure& departure,
                                     std::span<const Segment> laid, double off_mm);

}  // namespace weldcell::workpiece
