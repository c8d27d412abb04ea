#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "member_axis.hpp"
#include "weldcell/guidance/drawing.hpp"

namespace weldcell::guidance {

namespace {

using workpiece::Fixture;
using workpiece::Member;
using workpiece::Workpiece;

constexpr double kMemberGapMm = 2;   // to members that the magnet does not hold
constexpr double kFixtureGapMm = 5;  // room for a hand between magnets
constexpr double kEndInset = 0.12;   // of the side's length: magnets near the ends hold the angle best
constexpr double kPlaceStepMm = 5;
constexpr std::array kDiametersMm{40.0, 30.0, 20.0};

double clearance(const Polygon& outline, const Vec2& p) {
  if (contains(outline, p)) return 0;
  double nearest = 1e300;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    nearest = std::min(nearest, distance(p, Segment{outline[i], outline[(i + 1) % outline.size()]}));
  }
  return nearest;
}

class Placer {
 public:
  explicit Placer(const Workpiece& workpiece) : workpiece_(workpiece) {
    double area = 0;
    for (const Member& m : workpiece.members) {
      const double a = std::abs(signed_area(m.outline));
      middle_ += a * centroid(m.outline);
      area += a;
    }
    if (area > 0) middle_ /= area;
  }

  std::vector<Fixture> run() {
    for (std::size_t i = 0; i < workpiece_.members.size(); ++i) {
      for (const double diameter : kDiametersMm) {
        if (along_axis(i, diameter)) break;
      }
    }
    for (std::size_t i = 0; i < workpiece_.members.size(); ++i) at_a_free_end(i);
    return std::move(out_);
  }

 private:
  const Member& member(std::size_t i) const { return workpiece_.members[i]; }

  bool free(std::size_t held, const Vec2& centre, double diameter) const {
    for (std::size_t i = 0; i < workpiece_.members.size(); ++i) {
      const double room = clearance(member(i).outline, centre) - diameter / 2;
      if (room < (i == held ? -1e-6 : kMemberGapMm)) return false;
    }
    return std::all_of(out_.begin(), out_.end(), [&](const Fixture& f) {
      return (Vec2(f.x_mm, f.y_mm) - centre).norm() >= (f.diameter_mm + diameter) / 2 + kFixtureGapMm;
    });
  }

  static Segment side(const Member& m, std::size_t k) {
    return {m.outline[k], m.outline[(k + 1) % m.outline.size()]};
  }
  static Vec2 outward(const Segment& s) { return {s.direction().y(), -s.direction().x()}; }

  /// Sides of a member along (or across) its axis, those that face away from the middle of the workpiece
  /// first.
  std::vector<Segment> sides(const Member& m, bool along) const {
    const Vec2 axis = centre_line(m).direction();
    std::vector<Segment> out;
    for (std::size_t k = 0; k < m.outline.size(); ++k) {
      const Segment s = side(m, k);
      if (s.length() > 1 && (std::abs(s.direction().dot(axis)) > 0.7) == along) out.push_back(s);
    }
    const auto outer = [&](const Segment& s) { return outward(s).dot((s.a + s.b) / 2 - middle_); };
    std::stable_sort(out.begin(), out.end(), [&](const Segment& a, const Segment& b) {
      const bool longer = a.length() > 1.5 * b.length(), shorter = b.length() > 1.5 * a.length();
      return longer || (!shorter && outer(a) > outer(b));
    });
    return out;
  }

  void put(std::size_t held, const Vec2& centre, double diameter) {
    out_.push_back({centre.x(), centre.y(), diameter, member(held).name});
  }

  /// The free place on the side closest to the share of its length.
  std::optional<Vec2> place_on(std::size_t held, const Segment& s, double share, double diameter) const {
    const Vec2 away = outward(s) * (diameter / 2);
    const double wanted = share * s.length();
    for (double off = 0; off < s.length(); off += kPlaceStepMm) {
      for (const double at : {wanted + off, wanted - off}) {
        if (at < 0 || at > s.length()) continue;
        const Vec2 centre = s.a + at * s.direction() + away;
        if (free(held, centre, diameter)) return centre;
      }
    }
    return std::nullopt;
  }

  bool along_axis(std::size_t held, double diameter) {
    for (const Segment& s : sides(member(held), true)) {
      const std::size_t before = out_.size();
      const auto first = place_on(held, s, kEndInset, diameter);
      if (!first) continue;
      put(held, *first, diameter);
      const auto second = place_on(held, s, 1 - kEndInset, diameter);
      if (second && (*second - *first).norm() > 0.25 * s.length()) {
        put(held, *second, diameter);
        return true;
      }
      out_.resize(before);
    }
    return false;
  }

  /// One more against an end that no other member holds: with the two along the axis it fixes the place
  /// fully.
  void at_a_free_end(std::size_t held) {
    const std::vector<Segment> ends = sides(member(held), false);
    const bool held_by_member = std::any_of(ends.begin(), ends.end(), [&](const Segment& s) {
      const Vec2 beyond = (s.a + s.b) / 2 + outward(s);
      for (std::size_t i = 0; i < workpiece_.members.size(); ++i) {
        if (i != held && clearance(member(i).outline, beyond) < 1) return true;
      }
      return false;
    });
    if (held_by_member) return;
    for (const Segment& s : ends) {
      if (const auto centre = place_on(held, s, 0.5, kDiametersMm.front()))
        return put(held, *centre, kDiametersMm.front());
    }
  }

  const Workpiece& workpiece_;
  Vec2 middle_ = Vec2::Zero();
  std::vector<Fixture> out_;
};

}  // namespace

Segment centre_line(const Member& member) {
  const Polygon& o = member.outline;
  Segment longest{o.front(), o.front()};
  for (std::size_t k = 0; k < o.size(); ++k) {
    const Segment s{o[k], o[(k + 1) % o.size()]};
    if (s.length() > longest.length() + 1e-9) longest = s;
  }
  const Vec2 axis = longest.direction(), middle = centroid(o);
  double from = 0, to = 0;
  for (const Vec2& p : o) {
    from = std::min(from, axis.dot(p - middle));
    to = std::max(to, axis.dot(p - middle));
  }
  return {middle + from * axis, middle + to * axis};
}

std::vector<Fixture> place_fixtures(const Workpiece& workpiece) {
  if (!workpiece.fixtures.empty()) return workpiece.fixtures;
  return Placer(workpiece).run();
}

std::vector<GuideStep> guide_steps(const Workpiece& workpiece, const Pose2& planned) {
  const std::vector<Fixture> fixtures = place_fixtures(workpiece);
  std::vector<GuideStep> out;
  for (std::size_t i = 0; i < workpiece.members.size(); ++i) {
    const Member& m = workpiece.members[i];
    const Segment axis = centre_line(m);
    GuideStep step;
    step.member = static_cast<int>(i);
    step.title = fmt::format("Place member {}: {}", m.tag.empty() ? std::to_string(i + 1) : m.tag, m.name);
    step.centre_base_mm = planned * Vec2((axis.a + axis.b) / 2);
    const Vec2 along = planned.rotate(axis.direction());
    step.heading_rad = std::atan2(along.y(), along.x());
    for (const Fixture& f : fixtures) {
      if (f.member == m.name) step.fixtures.push_back(f);
    }
    out.push_back(std::move(step));
  }
  return out;
}

}  // namespace weldcell::guidance
