// Where two members touch and which way the joint opens, from their outlines. Pure.
#pragma once

#include <optional>

#include "weldcell/workpiece/workpiece.hpp"

namespace weldcell::weld {

struct Contact {
  Vec2 normal = Vec2::UnitX();  ///< unit, frame Part, from the first member to the second
  Segment line;                 ///< on the first member's side, the stretch that faces the second
};

/// The pair of sides that face each other, closest to `near`; none when the members do not touch (lap joint,
/// or apart).
std::optional<Contact> contact(const workpiece::Member& first, const workpiece::Member& second,
                               const Vec2& near, double reach_mm = 2.0);

}  // namespace weldcell::weld
