#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "cad/cad_part.hpp"
#include "cad/dxf_drawing.hpp"
#include "cad/outline.hpp"

namespace weldcell::cad {

namespace {

constexpr double kJoinMm = 0.01;    ///< ends of curves closer than this meet
constexpr double kMinAreaMm2 = 25;  ///< smaller loops are drawing furniture, not members

struct Loop {
  int group = 0;
  Polygon outline;
  std::size_t order = 0;  ///< in the drawing
};

/// mm of one unit by $INSUNITS; 0 = unitless or none that a weldment is drawn in.
double mm_of_insunits(int code) {
  switch (code) {
    case 1:
      return 25.4;
    case 2:
      return 304.8;
    case 4:
      return 1;
    case 5:
      return 10;
    case 6:
      return 1000;
    default:
      return 0;
  }
}

/// Open curves of one group as a graph of their ends: loops where every end meets exactly one other.
struct Chains {
  std::vector<Loop> loops;
  int open = 0;      ///< curves that end in nothing
  int branches = 0;  ///< points where more than two curves meet
  Vec2 branch_at = Vec2::Zero();
};

void walk_loop(const std::vector<const Curve*>& curves, const std::vector<std::pair<int, int>>& ends,
               std::map<int, std::vector<std::size_t>>& at_point, std::size_t first, std::vector<bool>& used,
               Loop& loop) {
  std::size_t current = first;
  int from = ends[first].first;
  while (!used[current]) {
    used[current] = true;
    std::vector<Vec2> points = curves[current]->points;
    int to = ends[current].second;
    if (ends[current].first != from) {
      std::reverse(points.begin(), points.end());
      to = ends[current].first;
    }
    loop.outline.insert(loop.outline.end(), points.begin(), points.end() - 1);
    const std::vector<std::size_t>& here = at_point[to];
    current = here[0] == current ? here[1] : here[0];
    from = to;
  }
}

Chains chain(const std::vector<const Curve*>& curves, int group) {
  Chains out;
  PointPool pool(kJoinMm);
  std::vector<const Curve*> kept;
  std::vector<std::pair<int, int>> ends;
  std::set<std::pair<int, int>> straight;
  std::map<int, std::vector<std::size_t>> at_point;
  for (const Curve* curve : curves) {
    const std::pair<int, int> end{pool.id(curve->points.front()), pool.id(curve->points.back())};
    double length = 0;
    for (std::size_t i = 1; i < curve->points.size(); ++i)
      length += (curve->points[i] - curve->points[i - 1]).norm();
    if (length < kJoinMm) continue;
    if (end.first == end.second) {
      out.loops.push_back({group, Polygon(curve->points.begin(), curve->points.end() - 1), 0});
      continue;
    }
    // A line drawn twice is one line.
    if (curve->points.size() == 2 && !straight.insert(std::minmax({end.first, end.second})).second) continue;
    at_point[end.first].push_back(kept.size());
    at_point[end.second].push_back(kept.size());
    kept.push_back(curve);
    ends.push_back(end);
  }
  for (const auto& [point, here] : at_point) {
    if (here.size() > 2) {
      ++out.branches;
      out.branch_at = pool.point(point);
    }
  }
  if (out.branches > 0) return out;
  std::vector<bool> used(kept.size(), false);
  // Chains that end somewhere are walked away first; only rings remain.
  std::vector<int> dead;
  for (const auto& [point, here] : at_point) {
    if (here.size() == 1) dead.push_back(point);
  }
  while (!dead.empty()) {
    const int point = dead.back();
    dead.pop_back();
    for (const std::size_t i : at_point[point]) {
      if (used[i]) continue;
      used[i] = true;
      ++out.open;
      dead.push_back(ends[i].first == point ? ends[i].second : ends[i].first);
    }
  }
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (used[i]) continue;
    Loop loop{group, {}, 0};
    walk_loop(kept, ends, at_point, i, used, loop);
    out.loops.push_back(std::move(loop));
  }
  return out;
}

Result<std::vector<Loop>> find_loops(const Drawing& drawing, std::vector<std::string>& notes) {
  std::vector<Loop> loops;
  std::map<int, std::vector<const Curve*>> open;
  for (const Curve& curve : drawing.curves) {
    if (curve.closed) {
      loops.push_back({curve.group, curve.points, 0});
    } else {
      open[curve.group].push_back(&curve);
    }
  }
  int open_curves = 0;
  for (const auto& [group, curves] : open) {
    Chains chains = chain(curves, group);
    if (chains.branches > 0) {
      return fault("cad.outline",
                   fmt::format("the lines on '{}' branch at {} points (one at {:.2f}, {:.2f} mm): they show "
                               "the whole, not each "
                               "member's own outline",
                               drawing.groups[static_cast<std::size_t>(group)], chains.branches,
                               chains.branch_at.x(), chains.branch_at.y()),
                   "draw one closed outline a member, or import the STEP file");
    }
    open_curves += chains.open;
    loops.insert(loops.end(), chains.loops.begin(), chains.loops.end());
  }
  if (open_curves > 0)
    notes.push_back(fmt::format("{} curve(s) that close no outline were left out", open_curves));
  std::vector<Loop> sound;
  for (Loop& loop : loops) {
    loop.order = sound.size();
    loop.outline = straightened(loop.outline);
    if (signed_area(loop.outline) < 0) std::reverse(loop.outline.begin(), loop.outline.end());
    if (loop.outline.size() >= 3 && signed_area(loop.outline) > kMinAreaMm2) sound.push_back(std::move(loop));
  }
  return sound;
}

bool lies_inside(const Polygon& inner, const Polygon& outer) {
  return std::all_of(inner.begin(), inner.end(), [&](const Vec2& p) { return contains(outer, p); });
}

/// Loops in loops are openings: small ones are left out with a note, big ones mean that the drawing shows a
/// whole frame.
Status drop_openings(std::vector<Loop>& loops, const Drawing& drawing, std::vector<std::string>& notes) {
  std::stable_sort(loops.begin(), loops.end(), [](const Loop& a, const Loop& b) {
    return signed_area(a.outline) > signed_area(b.outline) + 1e-6;
  });
  std::vector<Loop> outer;
  std::map<std::size_t, std::pair<int, double>> openings;
  int doubled = 0;
  for (Loop& loop : loops) {
    std::size_t holder = outer.size();
    for (std::size_t i = 0; i < outer.size() && holder == outer.size(); ++i) {
      if (lies_inside(loop.outline, outer[i].outline)) holder = i;
    }
    if (holder == outer.size()) {
      outer.push_back(std::move(loop));
    } else if (std::abs(signed_area(loop.outline) - signed_area(outer[holder].outline)) < 1) {
      ++doubled;
    } else {
      ++openings[holder].first;
      openings[holder].second += signed_area(loop.outline);
    }
  }
  for (const auto& [holder, seen] : openings) {
    const std::string& name = drawing.groups[static_cast<std::size_t>(outer[holder].group)];
    if (seen.second > 0.3 * signed_area(outer[holder].outline)) {
      return fault("cad.outline",
                   fmt::format("an outline on '{}' holds {} more that fill most of it: a whole frame, a "
                               "sheet border or nested "
                               "outlines",
                               name, seen.first),
                   "draw each member's own closed outline and nothing around them");
    }
    notes.push_back(fmt::format("{}: {} opening(s) inside an outline were left out", name, seen.first));
  }
  if (doubled > 0) notes.push_back(fmt::format("{} outline(s) drawn twice were taken once", doubled));
  loops = std::move(outer);
  return Done{};
}

std::vector<workpiece::Member> named_members(std::vector<Loop>& loops, const Drawing& drawing) {
  // The drawing's order, not the order of size.
  std::stable_sort(loops.begin(), loops.end(), [](const Loop& a, const Loop& b) {
    return std::tie(a.group, a.order) < std::tie(b.group, b.order);
  });
  std::map<std::string, int> uses, given;
  for (const Loop& loop : loops) ++uses[drawing.groups[static_cast<std::size_t>(loop.group)]];
  std::vector<workpiece::Member> out;
  for (Loop& loop : loops) {
    std::string name = drawing.groups[static_cast<std::size_t>(loop.group)].substr(0, 50);
    name.erase(
        std::remove_if(name.begin(), name.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20; }),
        name.end());
    if (name.empty() || name == "0" || name[0] == '*') {
      name = "m" + std::to_string(out.size() + 1);
    } else if (uses[name] > 1) {
      name += "_" + std::to_string(++given[name]);
    }
    out.push_back({name, "", std::move(loop.outline), 0});
  }
  return out;
}

/// Contact and overlap of all pairs, for telling which line of a round section is drawn.
struct Fit {
  double contact_mm = 0, overlap_mm = 0;
};

Fit fit_of(const std::vector<workpiece::Member>& members) {
  Fit fit;
  for (std::size_t i = 0; i < members.size(); ++i) {
    for (std::size_t k = i + 1; k < members.size(); ++k) {
      fit.contact_mm += contact_length(members[i].outline, members[k].outline, 0.5);
      fit.overlap_mm = std::max(fit.overlap_mm, overlap_depth(members[i].outline, members[k].outline));
    }
  }
  return fit;
}

Status apply_radius(CadPart& part, const Options& options) {
  const double radius = options.edge_radius_mm;
  if (radius <= 0) return Done{};
  std::vector<workpiece::Member> wider = part.members;
  std::size_t as_flat = 0, as_silhouette = 0;
  for (workpiece::Member& m : wider) {
    const double width = width_across(m.outline);
    as_flat += std::abs(width + 2 * radius - options.height_mm) < 0.25 ? 1 : 0;
    as_silhouette += std::abs(width - options.height_mm) < 0.25 ? 1 : 0;
    m.outline = widened(m.outline, radius);
  }
  Drawn drawn = options.drawn;
  if (drawn == Drawn::Unsaid) {
    const Fit thin = fit_of(part.members), wide = fit_of(wider);
    const bool thin_fits = thin.overlap_mm < 1 && thin.contact_mm >= 5;
    const bool wide_fits = wide.overlap_mm < 1 && wide.contact_mm >= 5;
    if (thin_fits != wide_fits) {
      drawn = wide_fits ? Drawn::Flat : Drawn::Silhouette;
    } else if ((as_flat == wider.size()) != (as_silhouette == wider.size())) {
      drawn = as_flat == wider.size() ? Drawn::Flat : Drawn::Silhouette;
    } else {
      return fault("cad.drawn",
                   fmt::format("with round edges of {:g} mm it is not clear which line is drawn: the flat "
                               "top or the silhouette",
                               radius),
                   "say --drawn flat or --drawn silhouette (cad: drawn in a job)");
    }
  }
  if (drawn == Drawn::Flat) {
    part.members = std::move(wider);
    part.notes.push_back(fmt::format(
        "the drawn lines are the flat tops; silhouettes are {:g} mm wider on each long side", radius));
  } else {
    part.notes.push_back("the drawn lines are the silhouettes");
  }
  for (workpiece::Member& m : part.members) m.edge_radius_mm = radius;
  return Done{};
}

}  // namespace

Result<CadPart> read_dxf(const std::string& path, const Options& options) {
  auto drawing = read_drawing(path);
  if (!drawing.ok()) return drawing.error();
  if (drawing->curves.empty())
    return fault("cad.empty", "holds no curve", "is it an ASCII DXF with entities in model space?");
  const double declared = mm_of_insunits(drawing->insunits);
  const double scale = options.units.empty() ? declared : mm_per_unit(options.units);
  if (scale <= 0) {
    return fault(
        "cad.units",
        drawing->insunits == 0
            ? std::string("says no length unit ($INSUNITS absent or 0)")
            : fmt::format("says the length unit $INSUNITS = {}, which is not read", drawing->insunits),
        "say --units mm, inch or m (cad: units in a job)");
  }
  if (options.height_mm <= 0) {
    return fault("cad.height", "a DXF does not say how high the top is",
                 "say --height MM (cad: height_mm in a job)");
  }
  if (options.plane != Plane::Xy) return fault("cad.plane", "a DXF has one plane only", "leave out --plane");
  for (Curve& curve : drawing->curves) {
    for (Vec2& p : curve.points) p *= scale;
  }
  CadPart part;
  for (const auto& [kind, count] : drawing->left_out)
    part.notes.push_back(fmt::format("not read: {} {}", count, kind));
  auto loops = find_loops(*drawing, part.notes);
  if (!loops.ok()) return loops.error();
  if (loops->empty()) {
    return fault("cad.outline",
                 fmt::format("holds no closed outline, only {} curve(s)", drawing->curves.size()),
                 "close each member's outline; its ends must meet within 0.01 mm");
  }
  if (Status nested = drop_openings(*loops, *drawing, part.notes); !nested.ok()) return nested.error();
  if (loops->size() > kMaxMembers) {
    return fault("cad.limit", fmt::format("holds {} outlines", loops->size()),
                 fmt::format("at most {} members", kMaxMembers));
  }
  part.members = named_members(*loops, *drawing);
  for (const workpiece::Member& m : part.members) {
    if (m.outline.size() > kMaxVertices) {
      return fault("cad.limit", fmt::format("the outline of '{}' has {} vertices", m.name, m.outline.size()),
                   fmt::format("at most {}; simplify it", kMaxVertices));
    }
  }
  part.height_mm = options.height_mm;
  if (Status size = check_extent(part, drawing->insunits == 1 && options.units.empty()); !size.ok())
    return size.error();
  if (Status round = apply_radius(part, options); !round.ok()) return round.error();
  return part;
}

}  // namespace weldcell::cad
