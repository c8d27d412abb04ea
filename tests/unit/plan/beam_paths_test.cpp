#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "unit/plan/demo_cell.hpp"
#include "weldcell/plan/scan_plan.hpp"
#include "weldcell/workpiece/departures.hpp"

namespace weldcell::plan {
namespace {

std::string member_of(const BeamPath& path) { return path.name.substr(0, path.name.find(' ')); }

bool over_an_end(const BeamPath& path) { return path.name.find(" end ") != std::string::npos; }

int crossings(const BeamPath& path, const Segment& edge) {
  int count = 0;
  const auto side = [](const Segment& s, const Vec2& p) {
    const Vec2 d = s.b - s.a;
    return d.x() * (p - s.a).y() - d.y() * (p - s.a).x();
  };
  for (std::size_t i = 0; i + 1 < path.points.size(); ++i) {
    const Segment piece{path.points[i], path.points[i + 1]};
    count += side(edge, piece.a) * side(edge, piece.b) < 0 && side(piece, edge.a) * side(piece, edge.b) < 0;
  }
  return count;
}

struct Case {
  const char* name;
  workpiece::Workpiece workpiece;
  Pose2 pose;
};
std::vector<Case> cases() {
  return {{"ladder", testing::ladder(), testing::kLadderPose},
          {"ladder turned", testing::ladder(), {850, -300, rad(23)}},
          {"mitre", testing::mitre(), testing::kMitrePose}};
}

TEST(Zigzag, CrossesBothLongSidesOfEveryMemberInBothDirections) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    const auto outline = workpiece::build_template(c.workpiece);
    ASSERT_TRUE(outline.ok());
    Inspection inspection;
    inspection.passes_per_member = 4;
    std::map<std::string, std::vector<Vec2>> directions;
    for (const BeamPath& path : beam_paths(c.workpiece, c.pose, inspection, Pattern::Zigzag)) {
      if (over_an_end(path)) continue;
      SCOPED_TRACE(path.name);
      ASSERT_EQ(path.points.size(), 2u);
      const Segment line{path.points[0], path.points[1]};
      EXPECT_NEAR(line.length(), inspection.span_mm, 1e-9);
      directions[member_of(path)].push_back(line.direction());
      const Vec2 receiver(std::cos(path.receiver_angle_rad), std::sin(path.receiver_angle_rad));
      EXPECT_NEAR(receiver.dot(line.direction()), 0, 1e-9) << "the triangulation plane lies along the edge";
      int own = 0, foreign = 0;
      for (const workpiece::VisibleEdge& edge : outline->edges) {
        const Segment placed{c.pose * edge.line.a, c.pose * edge.line.b};
        const bool mine = outline->member_names[static_cast<std::size_t>(edge.member)] == member_of(path);
        (mine ? own : foreign) += crossings(path, placed);
        if (!mine) {
          for (int k = 0; k <= 20; ++k) {
            const Vec2 at = line.a + (line.b - line.a) * k / 20;
            EXPECT_GT(distance(at, placed), 5) << "runs along a neighbour's edge";
          }
        }
      }
      EXPECT_EQ(own, 2);
      EXPECT_EQ(foreign, 0);
    }
    EXPECT_EQ(directions.size(), c.workpiece.members.size());
    for (const auto& [member, all] : directions) {
      ASSERT_EQ(all.size(), 4u) << member;
      for (std::size_t i = 1; i < all.size(); ++i) EXPECT_NEAR(all[i].dot(all[i - 1]), -1, 1e-9) << member;
    }
  }
}

TEST(Zigzag, IsCentredOnTheAxisAndSpreadAlongIt) {
  Inspection inspection;
  inspection.passes_per_member = 4;
  std::vector<double> along;
  for (const BeamPath& path : beam_paths(testing::ladder(), {}, inspection, Pattern::Zigzag)) {
    if (over_an_end(path)) continue;
    const Vec2 middle = (path.points[0] + path.points[1]) / 2;
    if (member_of(path) == "rail_L") {
      EXPECT_NEAR(middle.y(), 20, 1e-9);
      along.push_back(middle.x());
    }
    if (member_of(path) == "rung_2") {
      EXPECT_NEAR(middle.x(), 400, 1e-9);
    }
  }
  ASSERT_EQ(along.size(), 4u);
  EXPECT_NEAR(along.front(), 70, 1e-9);
  EXPECT_NEAR(along.back(), 1130, 1e-9);
  for (std::size_t i = 1; i < 4; ++i)
    EXPECT_NEAR(along[i] - along[i - 1], 1060 / 3.0, 80) << "moved farther than a joint needs";
}

/// A cross bar whose ends lie inside slanting legs, so that one end too short by 20 mm leaves but a wedge.
workpiece::Workpiece a_frame() {
  workpiece::Workpiece w;
  w.name = "a_frame";
  w.height_mm = 40;
  const auto bar = [&](const char* name, const Vec2& from, const Vec2& to, double width_mm) {
    const Vec2 d = (to - from).normalized(), n = width_mm / 2 * Vec2(-d.y(), d.x());
    workpiece::Member m;
    m.name = m.tag = name;
    m.outline = {from - n, to - n, to + n, from + n};
    w.members.push_back(m);
  };
  bar("foot", {-400, -260}, {400, -260}, 60);
  bar("left", {-330, -230}, {-30, 300}, 50);
  bar("right", {330, -230}, {30, 300}, 50);
  bar("cross", {-190, 0}, {190, 0}, 40);
  return *workpiece::validated(std::move(w));
}

TEST(Zigzag, ShowsEveryDepartureWhereverThePartLiesWithinEightMillimetres) {
  std::vector<Case> all = cases();
  all.push_back({"a_frame", a_frame(), {}});
  for (const Case& c : all) {
    SCOPED_TRACE(c.name);
    const auto outline = workpiece::build_template(c.workpiece);
    ASSERT_TRUE(outline.ok());
    std::vector<Segment> laid, across;
    for (const BeamPath& path : beam_paths(c.workpiece, {}, {}, Pattern::Zigzag)) {
      ASSERT_EQ(path.points.size(), 2u);
      laid.push_back({path.points[0], path.points[1]});
      if (!over_an_end(path)) across.push_back(laid.back());
    }
    int asked = 0, more = 0;
    for (std::size_t m = 0; m < outline->members.size(); ++m) {
      for (const double by_mm : {10.0, 20.0}) {
        for (const workpiece::Departure& d :
             workpiece::departures(outline->members, outline->edges, m, by_mm, true)) {
          ++asked;
          more += !workpiece::settling_passes(outline->members, d, across, 8).empty();
          EXPECT_TRUE(workpiece::settling_passes(outline->members, d, laid, 8).empty())
              << outline->member_names[m] << " side " << d.side << " by " << by_mm;
        }
      }
    }
    EXPECT_GT(asked, 20);
    EXPECT_GT(more, 4) << "the passes across the members do not show their ends";
  }
}

TEST(Zigzag, EndPassesAddLessThanAThirdToThePath) {
  double ends = 0, others = 0;
  for (const BeamPath& path : beam_paths(testing::ladder(), {}, {}, Pattern::Zigzag))
    (over_an_end(path) ? ends : others) += (path.points[1] - path.points[0]).norm();
  EXPECT_GT(ends, 0);
  EXPECT_LT(ends, others / 3);
}

TEST(Zigzag, PitchSetsTheNumberOfPasses) {
  Inspection inspection;
  inspection.pitch_mm = 40;
  std::map<std::string, int> count;
  for (const BeamPath& path : beam_paths(testing::ladder(), {}, inspection, Pattern::Zigzag))
    if (!over_an_end(path)) ++count[member_of(path)];
  EXPECT_EQ(count.size(), 6u);
  for (const auto& [member, passes] : count) {
    EXPECT_EQ(passes % 2, member.starts_with("rung") ? 0 : passes % 2) << member;
    EXPECT_GE(passes, member.starts_with("rail") ? 20 : 10) << member;
  }
}

TEST(Spiral, CoversTheOutlineWithItsMargin) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    Inspection inspection;
    inspection.pitch_mm = 60;
    const std::vector<BeamPath> paths = beam_paths(c.workpiece, c.pose, inspection, Pattern::Spiral);
    ASSERT_EQ(paths.size(), 1u);
    const std::vector<Vec2>& points = paths.front().points;
    // Every long side is crossed wherever the part may lie.
    const auto outline = workpiece::build_template(c.workpiece);
    for (const double turn : {-0.35, 0.0, 0.35}) {
      const Pose2 about_middle{outline->centroid.x(), outline->centroid.y(), 0};
      const Pose2 placed = c.pose * about_middle * Pose2{10, -10, turn} * about_middle.inverse();
      std::map<int, int> crossed;
      for (const workpiece::VisibleEdge& edge : outline->edges) {
        crossed[edge.member] += crossings(paths.front(), {placed * edge.line.a, placed * edge.line.b});
      }
      for (std::size_t m = 0; m < c.workpiece.members.size(); ++m) {
        EXPECT_GE(crossed[static_cast<int>(m)], 4) << c.workpiece.members[m].name << " at " << turn;
      }
    }
    // From inside to outside at equal steps, turns no farther apart than the pitch.
    Vec2 centre = Vec2::Zero();
    for (const auto& m : c.workpiece.members) centre += centroid(m.outline) * signed_area(m.outline);
    double area = 0;
    for (const auto& m : c.workpiece.members) area += signed_area(m.outline);
    centre = c.pose * Vec2(centre / area);
    EXPECT_LT((points.front() - centre).norm(), inspection.pitch_mm);
    EXPECT_GT((points.back() - centre).norm(), 400);
    const double step = (points[1] - points[0]).norm();
    for (std::size_t i = 1; i + 1 < points.size(); ++i) {
      EXPECT_NEAR((points[i] - points[i - 1]).norm(), step, 0.02 * step) << i;
    }
  }
}

TEST(Spiral, TurnsAreOnePitchApartAlongTheMajorAxis) {
  Inspection inspection;
  inspection.pitch_mm = 100;
  const std::vector<Vec2> points =
      beam_paths(testing::ladder(), {}, inspection, Pattern::Spiral).front().points;
  std::vector<double> crossed_x;  // where the curve meets the major axis y = 300 beyond the middle
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double a = points[i - 1].y() - 300, b = points[i].y() - 300;
    if (a * b > 0 || points[i].x() < 600) continue;
    crossed_x.push_back(points[i - 1].x() + (points[i].x() - points[i - 1].x()) * a / (a - b));
  }
  ASSERT_GE(crossed_x.size(), 5u);
  for (std::size_t i = 1; i < crossed_x.size(); ++i) EXPECT_NEAR(crossed_x[i] - crossed_x[i - 1], 100, 0.5);
}

TEST(BeamPaths, MoveWithThePart) {
  const Pose2 pose{700, 120, rad(-35)};
  for (const Pattern pattern : {Pattern::Zigzag, Pattern::Spiral}) {
    const auto at_origin = beam_paths(testing::mitre(), {}, {}, pattern),
               placed = beam_paths(testing::mitre(), pose, {}, pattern);
    ASSERT_EQ(at_origin.size(), placed.size());
    for (std::size_t i = 0; i < placed.size(); ++i) {
      EXPECT_NEAR(
          std::remainder(placed[i].receiver_angle_rad - at_origin[i].receiver_angle_rad - pose.theta_rad,
                         2 * kPi),
          0, 1e-12);
      for (std::size_t k = 0; k < placed[i].points.size(); ++k) {
        EXPECT_LT((placed[i].points[k] - pose * at_origin[i].points[k]).norm(), 1e-9);
      }
    }
  }
}

}  // namespace
}  // namespace weldcell::plan
