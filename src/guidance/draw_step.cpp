#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "lens.hpp"
#include "member_axis.hpp"
#include "text_place.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::guidance {

namespace {

using workpiece::Fixture;
using workpiece::Member;

constexpr double kPlaceWidthPx = 4, kPlacedWidthPx = 2, kCentreWidthPx = 2;
constexpr double kTagPx = 64, kTitlePx = 28, kNotePx = 22;
constexpr int kCircleCorners = 48;

std::vector<Vec2> closed(const Polygon& outline, const Pose2& planned) {
  std::vector<Vec2> out = transformed(outline, planned);
  out.push_back(out.front());
  return out;
}

double length(const std::vector<Vec2>& line) {
  double sum = 0;
  for (std::size_t i = 1; i < line.size(); ++i) sum += (line[i] - line[i - 1]).norm();
  return sum;
}

class StepPicture {
 public:
  StepPicture(const cell::CellSetup& cell, const workpiece::Workpiece& workpiece, const Pose2& planned,
              const Transform<Base, Projector>& T_base_projector)
      : workpiece_(workpiece),
        planned_(planned),
        table_z_(cell.table.z_mm),
        lens_(cell.projector, T_base_projector) {
    out_.width_px = cell.projector.width_px;
    out_.height_px = cell.projector.height_px;
  }

  Drawing draw(const std::vector<GuideStep>& steps, std::size_t current) {
    for (std::size_t s = 0; s < current && s < steps.size(); ++s) placed(steps[s]);
    if (current >= steps.size()) return std::move(out_);
    const GuideStep& step = steps[current];
    const Member& member = workpiece_.members[static_cast<std::size_t>(step.member)];
    const std::vector<Vec2> outline = closed(member.outline, planned_);
    const double shown = line(outline, table_z_, kPlaceWidthPx, Colour::Place);
    const Segment axis = centre_line(member);
    line({planned_ * axis.a, planned_ * axis.b}, table_z_, kCentreWidthPx, Colour::Place);
    for (const Fixture& f : step.fixtures) fixture(f);
    texts(step, member, shown);
    return std::move(out_);
  }

 private:
  /// Draws what shows of the line; the share of its length, in samples of the table, that shows.
  double line(const std::vector<Vec2>& mm, double z_mm, double width_px, Colour colour) {
    double shown_px = 0, whole_px = 0;
    std::vector<std::vector<Vec2>> pieces = lens_.visible(mm, z_mm);
    const bool loop = mm.size() > 2 && (mm.front() - mm.back()).norm() < 1e-9;
    // A loop that was cut begins somewhere in the middle of a piece: join its end to its beginning.
    if (loop && pieces.size() > 1 && (pieces.back().back() - pieces.front().front()).norm() < 1e-6) {
      pieces.back().insert(pieces.back().end(), pieces.front().begin() + 1, pieces.front().end());
      pieces.front() = std::move(pieces.back());
      pieces.pop_back();
    }
    for (std::vector<Vec2>& piece : pieces) {
      shown_px += length(piece);
      PixelLine drawn{std::move(piece), false, width_px, colour};
      drawn.closed = loop && pieces.size() == 1 && (drawn.px.front() - drawn.px.back()).norm() < 1e-6;
      if (drawn.closed) drawn.px.pop_back();
      out_.lines.push_back(std::move(drawn));
    }
    for (std::size_t i = 1; i < mm.size(); ++i) {
      const auto a = lens_.pixel({mm[i - 1].x(), mm[i - 1].y(), z_mm}),
                 b = lens_.pixel({mm[i].x(), mm[i].y(), z_mm});
      // An end that the lens cannot see makes the line longer than any picture.
      whole_px += a && b ? (*a - *b).norm() : 4.0 * out_.width_px;
    }
    return whole_px > 0 ? std::min(1.0, shown_px / whole_px) : 0;
  }

  /// Light on a member that lies there already falls on its top.
  void placed(const GuideStep& step) {
    const Member& member = workpiece_.members[static_cast<std::size_t>(step.member)];
    line(closed(member.outline, planned_), table_z_ + workpiece_.height_mm, kPlacedWidthPx, Colour::Placed);
  }

  void fixture(const Fixture& f) {
    const Vec2 centre = planned_ * Vec2(f.x_mm, f.y_mm);
    const double r = f.diameter_mm / 2;
    std::vector<Vec2> ring;
    for (int i = 0; i <= kCircleCorners; ++i) {
      const double a = 2 * kPi * (i % kCircleCorners) / kCircleCorners;
      ring.push_back(centre + r * Vec2(std::cos(a), std::sin(a)));
    }
    line(ring, table_z_, 3, Colour::Fixture);
    for (const Vec2& arm : {Vec2(1.4 * r, 0), Vec2(0, 1.4 * r)}) {
      const Vec2 turned = planned_.rotate(arm);
      line({centre - turned, centre + turned}, table_z_, 2, Colour::Fixture);
    }
  }

  void texts(const GuideStep& step, const Member& member, double shown) {
    TextPlace place(out_.width_px, out_.height_px, out_.lines);
    for (std::size_t i = 0; i < workpiece_.members.size(); ++i) {
      std::vector<Vec2> area;
      for (const Vec2& p : transformed(workpiece_.members[i].outline, planned_)) {
        if (const auto px = lens_.pixel(at(p))) area.push_back(*px);
      }
      if (area.size() == workpiece_.members[i].outline.size()) place.keep_off(area);
    }
    const Vec2 middle = visible_middle(step);
    const double w = out_.width_px, h = out_.height_px;
    const std::string tag = member.tag.empty() ? std::to_string(step.member + 1) : member.tag;
    out_.texts.push_back(place.put(tag, middle, kTagPx, Colour::Place));
    out_.texts.push_back(place.put(step.title, {w / 2, h - 24}, kTitlePx, Colour::Text));
    if (shown < 0.995) {
      const std::string note =
          shown > 0 ? fmt::format("{} runs out of the picture: {:.0f} % of its outline is shown", member.name,
                                  std::max(1.0, 100 * shown))
                    : fmt::format("{} lies outside the picture", member.name);
      out_.texts.push_back(place.put(note, {w / 2, 20}, kNotePx, Colour::Warning));
    }
  }

  Eigen::Vector3d at(const Vec2& p) const { return {p.x(), p.y(), table_z_}; }

  /// Middle of what shows of the current member, else of the picture.
  Vec2 visible_middle(const GuideStep& step) const {
    Vec2 sum = Vec2::Zero();
    double n = 0;
    for (const PixelLine& l : out_.lines) {
      if (l.colour != Colour::Place || l.width_px != kPlaceWidthPx) continue;
      for (const Vec2& p : l.px) sum += p, ++n;
    }
    if (n > 0) return sum / n;
    if (const auto p = lens_.pixel(at(step.centre_base_mm))) {
      return p->cwiseMax(Vec2(0, 0)).cwiseMin(Vec2(out_.width_px, out_.height_px));
    }
    return {out_.width_px / 2.0, out_.height_px / 2.0};
  }

  const workpiece::Workpiece& workpiece_;
  Pose2 planned_;
  double table_z_;
  Lens lens_;
  Drawing out_;
};

}  // namespace

Drawing draw_step(const cell::CellSetup& cell, const workpiece::Workpiece& workpiece, const Pose2& planned,
                  const std::vector<GuideStep>& steps, std::size_t current,
                  const Transform<Base, Projector>& T_base_projector) {
  return StepPicture(cell, workpiece, planned, T_base_projector).draw(steps, current);
}

}  // namespace weldcell::guidance
