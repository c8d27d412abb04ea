#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "patterns.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/workpiece/departures.hpp"

namespace weldcell::plan {

namespace {

struct Interval {
  double from = 0, to = 0;
};

/// A member laid along its long axis: `along` and `across` are unit vectors, positions are measured from the
/// origin.
struct Strip {
  std::string name;
  Vec2 along = Vec2::UnitX(), across = Vec2::UnitY();
  double centre = 0;  ///< of the axis, measured across
  double half_width = 0;
  std::vector<Interval> free;  ///< where a line across meets both long sides in the open
};

/// Edges up to this far from the long axis still bound the member's long sides.
constexpr double kLongSide_rad = 0.35;
/// Beyond half the member's width, the room a line keeps from a neighbour's edge: the beam and its fit
/// window.
constexpr double kClearOfJoint_mm = 10;

std::vector<Interval> merged(std::vector<Interval> all) {
  std::sort(all.begin(), all.end(), [](const Interval& a, const Interval& b) { return a.from < b.from; });
  std::vector<Interval> out;
  for (const Interval& i : all) {
    if (!out.empty() && i.from <= out.back().to + 1e-6) {
      out.back().to = std::max(out.back().to, i.to);
    } else {
      out.push_back(i);
    }
  }
  return out;
}

std::vector<Interval> common(const std::vector<Interval>& a, const std::vector<Interval>& b) {
  std::vector<Interval> out;
  for (const Interval& i : a) {
    for (const Interval& j : b) {
      const Interval both{std::max(i.from, j.from), std::min(i.to, j.to)};
      if (both.to > both.from) out.push_back(both);
    }
  }
  return merged(out);
}

/// Shrinks each interval by the clearance, or less where it is too short for that, never below a third of it.
std::vector<Interval> shrunk(const std::vector<Interval>& all, double by) {
  std::vector<Interval> out;
  for (const Interval& i : all) {
    const double take = std::min(by, (i.to - i.from) / 3);
    out.push_back({i.from + take, i.to - take});
  }
  return out;
}

Strip strip_of(const workpiece::OutlineTemplate& outline, std::size_t member) {
  Strip strip;
  strip.name = outline.member_names[member];
  const Polygon& polygon = outline.members[member];
  double longest = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2 side = polygon[(i + 1) % polygon.size()] - polygon[i];
    if (side.norm() <= longest * (1 + 1e-9)) continue;
    longest = side.norm();
    strip.along = side.normalized();
  }
  // The first of two equally long sides decides by chance of the drawing; one sense for all makes plans
  // comparable.
  if (strip.along.x() < -1e-9 || (std::abs(strip.along.x()) <= 1e-9 && strip.along.y() < 0))
    strip.along = -strip.along;
  strip.across = {-strip.along.y(), strip.along.x()};
  double low = std::numeric_limits<double>::max(), high = std::numeric_limits<double>::lowest();
  for (const Vec2& p : polygon) {
    low = std::min(low, strip.across.dot(p));
    high = std::max(high, strip.across.dot(p));
  }
  strip.centre = (low + high) / 2;
  strip.half_width = (high - low) / 2;

  std::vector<Interval> left, right;
  for (const workpiece::VisibleEdge& edge : outline.edges) {
    if (edge.member != static_cast<int>(member)) continue;
    if (std::abs(edge.line.direction().dot(strip.along)) < std::cos(kLongSide_rad)) continue;
    const double a = strip.along.dot(edge.line.a), b = strip.along.dot(edge.line.b);
    (edge.outward.dot(strip.across) > 0 ? left : right).push_back({std::min(a, b), std::max(a, b)});
  }
  strip.free = common(merged(left), merged(right));
  // A member that others hide on one side still shows the other.
  if (strip.free.empty()) strip.free = merged(left.empty() ? right : left);
  strip.free = shrunk(strip.free, strip.half_width + kClearOfJoint_mm);
  return strip;
}

double nearest_free(const Strip& strip, double position) {
  double best = position, distance = std::numeric_limits<double>::max();
  for (const Interval& i : strip.free) {
    const double inside = std::clamp(position, i.from, i.to);
    if (std::abs(inside - position) >= distance) continue;
    distance = std::abs(inside - position);
    best = inside;
  }
  return best;
}

/// Positions along the strip, evenly from end to end, moved out of the joints.
std::vector<double> positions_of(const Strip& strip, const Inspection& inspection) {
  const double from = strip.free.front().from, to = strip.free.back().to;
  int count = inspection.passes_per_member;
  if (count <= 0) {
    count = static_cast<int>(std::floor((to - from) / std::max(1.0, inspection.pitch_mm) + 1e-9)) + 1;
  }
  count = std::max(2, count + count % 2);
  std::vector<double> out;
  for (int i = 0; i < count; ++i) {
    const double position = nearest_free(strip, from + (to - from) * i / (count - 1));
    if (out.empty() || position > out.back() + 1e-6) out.push_back(position);
  }
  return out;
}

struct Planned {
  Strip strip;
  std::vector<double> positions;
  std::vector<Segment> low_ends, high_ends;  ///< passes over the members' ends, at either end of the strip
};

/// Departures that the passes must show: the second ones where the first stay under another member.
constexpr double kDepartures_mm[] = {10, 20};
/// A part is laid down this close to the projected outline, in x and in y, or it was found.
constexpr double kLaidWithin_mm = 8;

Vec2 axis_point(const Planned& p, double position) {
  return position * p.strip.along + p.strip.centre * p.strip.across;
}

std::vector<Segment> zigzag_lines(const std::vector<Planned>& all, double span_mm) {
  std::vector<Segment> out;
  for (const Planned& planned : all) {
    const Vec2 half = span_mm / 2 * planned.strip.across;
    for (const double position : planned.positions) {
      const Vec2 centre = axis_point(planned, position);
      out.push_back({centre - half, centre + half});
    }
  }
  return out;
}

/// Passes that show where the member's ends are: along the member, over the end or over the joint that hides
/// it, where an end too far back would leave a slot. What else the passes laid so far would not show gets a
/// pass of its own. `laid` grows by them.
void add_end_passes(const workpiece::OutlineTemplate& outline, std::size_t member, std::vector<Segment>& laid,
                    Planned& planned) {
  const std::vector<Polygon>& members = outline.members;
  const Vec2 middle = centroid(members[member]);
  for (const bool ends : {true, false}) {
    for (const double by_mm : kDepartures_mm) {
      for (const workpiece::Departure& d :
           workpiece::departures(members, outline.edges, member, by_mm, true)) {
        if (d.end != ends) continue;
        for (const Segment& pass : workpiece::settling_passes(members, d, laid, kLaidWithin_mm)) {
          laid.push_back(pass);
          const bool high = ((pass.a + pass.b) / 2 - middle).dot(planned.strip.along) > 0;
          (high ? planned.high_ends : planned.low_ends).push_back(pass);
        }
      }
    }
  }
}

/// Each pass from the side where the beam already is; the receiver looks along the edges that it crosses.
void append_end_passes(const Planned& member, bool high, std::vector<BeamPath>& out) {
  int number = high && !member.low_ends.empty() ? 2 : 1;
  for (Segment pass : high ? member.high_ends : member.low_ends) {
    if (!out.empty()) {
      const Vec2& at = out.back().points.back();
      if ((pass.b - at).norm() < (pass.a - at).norm()) std::swap(pass.a, pass.b);
    }
    BeamPath path;
    path.name = fmt::format("{} end {}", member.strip.name, number++);
    path.points = {pass.a, pass.b};
    const Vec2 d = pass.direction();
    path.receiver_angle_rad = std::atan2(d.x(), -d.y());
    out.push_back(std::move(path));
  }
}

void append_passes(const Planned& member, bool backwards, double span_mm, std::vector<BeamPath>& out) {
  append_end_passes(member, backwards, out);
  std::vector<double> order = member.positions;
  if (backwards) std::reverse(order.begin(), order.end());
  const Vec2 half = span_mm / 2 * member.strip.across;
  // Begin on the side where the beam already is.
  const Vec2 first = axis_point(member, order.front());
  double sense = 1;
  if (!out.empty() && (out.back().points.back() - first).dot(half) > 0) sense = -1;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Vec2 centre = axis_point(member, order[i]);
    BeamPath path;
    path.name = fmt::format("{} zigzag {}", member.strip.name, i + 1);
    path.points = {centre - sense * half, centre + sense * half};
    path.receiver_angle_rad = std::atan2(member.strip.along.y(), member.strip.along.x());
    out.push_back(std::move(path));
    sense = -sense;
  }
  append_end_passes(member, !backwards, out);
}

}  // namespace

std::vector<BeamPath> zigzag_paths(const workpiece::Workpiece& workpiece, const Inspection& inspection) {
  const Result<workpiece::OutlineTemplate> outline = workpiece::build_template(workpiece);
  if (!outline) return {};
  std::vector<Planned> open;
  std::vector<std::size_t> member_of;
  for (std::size_t m = 0; m < workpiece.members.size(); ++m) {
    Strip strip = strip_of(*outline, m);
    if (strip.free.empty()) continue;
    std::vector<double> positions = positions_of(strip, inspection);
    open.push_back({std::move(strip), std::move(positions), {}, {}});
    member_of.push_back(m);
  }
  std::vector<Segment> laid = zigzag_lines(open, inspection.span_mm);
  for (std::size_t i = 0; i < open.size(); ++i) add_end_passes(*outline, member_of[i], laid, open[i]);
  std::vector<BeamPath> out;
  bool first = true;
  Vec2 at = Vec2::Zero();
  while (!open.empty()) {
    std::size_t best = 0;
    bool backwards = false;
    double distance = std::numeric_limits<double>::max();
    for (std::size_t i = 0; i < open.size(); ++i) {
      for (const bool back : {false, true}) {
        const double p = back ? open[i].positions.back() : open[i].positions.front();
        const double way = first ? 0 : (axis_point(open[i], p) - at).norm();
        if (way >= distance - 1e-9) continue;
        distance = way;
        best = i;
        backwards = back;
      }
    }
    append_passes(open[best], backwards, inspection.span_mm, out);
    at = axis_point(open[best], backwards ? open[best].positions.front() : open[best].positions.back());
    open.erase(open.begin() + static_cast<std::ptrdiff_t>(best));
    first = false;
  }
  return out;
}

}  // namespace weldcell::plan
