#include "weldcell/workpiece/departures.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace weldcell::workpiece {
namespace {

Polygon box(const Vec2& low, const Vec2& high) {
  return {low, {high.x(), low.y()}, high, {low.x(), high.y()}};
}

/// A post of 40 x 400 between two rails of 800 x 40.
Workpiece frame() {
  Workpiece w;
  w.name = "frame";
  w.height_mm = 40;
  for (const auto& [name, outline] :
       {std::pair{"low", box({0, 0}, {800, 40})}, std::pair{"high", box({0, 440}, {800, 480})},
        std::pair{"post", box({300, 40}, {340, 440})}}) {
    Member m;
    m.name = m.tag = name;
    m.outline = outline;
    w.members.push_back(m);
  }
  return *validated(std::move(w));
}

constexpr int kLow = 0, kPost = 2;

std::vector<Departure> of(const OutlineTemplate& part, int member, bool free_ends) {
  return departures(part.members, part.edges, static_cast<std::size_t>(member), 10, free_ends);
}

const Departure* find(const std::vector<Departure>& all, const Vec2& outward, double by_mm,
                      const Polygon& drawn) {
  for (const Departure& d : all) {
    if (d.side < 0 || d.outward.dot(outward) < 0.99) continue;
    const auto k = static_cast<std::size_t>(d.side);
    if (std::abs((d.instead[k] - drawn[k]).dot(outward) - by_mm) < 1e-9) return &d;
  }
  return nullptr;
}

TEST(Departures, AnEndInAJointOnlyMovesBackAndAPassAlongTheMemberTells) {
  const auto part = build_template(frame());
  ASSERT_TRUE(part.ok());
  const std::vector<Departure> all = of(*part, kPost, true);
  const Polygon& post = part->members[kPost];
  EXPECT_EQ(find(all, {0, -1}, 10, post), nullptr) << "through the rail";
  const Departure* back = find(all, {0, -1}, -10, post);
  ASSERT_NE(back, nullptr);
  EXPECT_TRUE(back->end);
  EXPECT_FALSE(back->whole);
  const auto pass = telling_pass(part->members, *back);
  ASSERT_TRUE(pass.has_value());
  EXPECT_NEAR(pass->a.x(), 320, 1e-9);
  EXPECT_NEAR(pass->b.x(), 320, 1e-9);
  EXPECT_GT(std::max(pass->a.y(), pass->b.y()), 40 + 10 + 10) << "room inside";
  EXPECT_LT(std::min(pass->a.y(), pass->b.y()), 40);
}

TEST(Departures, WhatGrowsIntoAnotherMemberIsOnePartFromAbove) {
  const auto part = build_template(frame());
  ASSERT_TRUE(part.ok());
  Departure grown;
  grown.member = kPost;
  grown.side = 0;
  grown.outward = {0, -1};
  grown.instead = box({300, 30}, {340, 440});
  grown.reach = bounds(grown.instead);
  EXPECT_FALSE(telling_pass(part->members, grown).has_value());
}

TEST(Departures, AnOpenEndMovesWithItsMemberUnlessAskedByItself) {
  const auto part = build_template(frame());
  ASSERT_TRUE(part.ok());
  const Polygon& low = part->members[kLow];
  const std::vector<Departure> shifts = of(*part, kLow, false), ends = of(*part, kLow, true);
  const Departure* shift = find(shifts, {1, 0}, -10, low);
  ASSERT_NE(shift, nullptr);
  EXPECT_TRUE(shift->whole);
  for (std::size_t k = 0; k < low.size(); ++k)
    EXPECT_LT((shift->instead[k] - low[k] - Vec2(-10, 0)).norm(), 1e-9) << k;
  for (const double by : {-10.0, 10.0}) {
    const Departure* end = find(ends, {1, 0}, by, low);
    ASSERT_NE(end, nullptr) << by;
    EXPECT_FALSE(end->whole);
    const Box2 box = bounds(end->instead);
    EXPECT_NEAR(box.max.x() - box.min.x(), 800 + by, 1e-9);
  }
}

TEST(Departures, AMemberTurnedAboutOneEndSwingsAtTheOther) {
  const auto part = build_template(frame());
  ASSERT_TRUE(part.ok());
  int turns = 0;
  for (const Departure& d : of(*part, kPost, false)) {
    if (d.side >= 0) continue;
    ++turns;
    const Vec2 far = d.outward.y() > 0 ? Vec2(300, 440) : Vec2(300, 40), near(300, 480 - far.y());
    double swung = 1e9, held = 1e9;
    for (const Vec2& p : d.instead)
      swung = std::min(swung, (p - far).norm()), held = std::min(held, (p - near).norm());
    EXPECT_NEAR(swung, 10, 0.2);
    EXPECT_LT(held, 1);
    EXPECT_TRUE(telling_pass(part->members, d).has_value());
  }
  EXPECT_EQ(turns, 4);
}

TEST(Departures, AShiftIsAskedAcrossTheSideThatMovesFarthest) {
  const auto part = build_template(frame());
  ASSERT_TRUE(part.ok());
  const std::vector<Departure> up = shifts(part->members, kPost, {3, 20});
  ASSERT_EQ(up.size(), 2U) << "the ends only";
  EXPECT_NEAR(up.front().instead.front().y(), part->members[kPost].front().y() + 20, 1e-9);
  for (const Departure& d : up) {
    EXPECT_TRUE(d.whole);
    EXPECT_TRUE(d.end);
  }
  const std::vector<Departure> aside = shifts(part->members, kPost, {-20, 0});
  ASSERT_EQ(aside.size(), 2U);
  EXPECT_FALSE(aside.front().end);
  const auto pass = telling_pass(part->members, aside.front());
  ASSERT_TRUE(pass.has_value());
  EXPECT_NEAR(pass->a.y(), pass->b.y(), 1e-9) << "square across a long side";
}

TEST(Departures, AMitredMemberMayLieTurnedOverAndABarMayNot) {
  const auto bars = build_template(frame());
  ASSERT_TRUE(bars.ok());
  EXPECT_TRUE(turned_over(bars->members, kPost).empty()) << "the same bar whichever way round";
  // Of the frame's lower rail the ends are mitred: turned over its long side lies inside.
  const std::vector<Polygon> mitred{{{0, 0}, {800, 0}, {750, 50}, {50, 50}},
                                    {{800, 0}, {800, 500}, {750, 450}, {750, 50}}};
  const std::vector<Departure> over = turned_over(mitred, 0);
  ASSERT_EQ(over.size(), 1U) << "end for end it is the same, and both are like the first";
  EXPECT_TRUE(over.front().over);
  EXPECT_GT(signed_area(over.front().instead), 0);
  double long_side_y = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const Segment side{over.front().instead[k], over.front().instead[(k + 1) % 4]};
    if (side.length() > 790) long_side_y = side.a.y();
  }
  EXPECT_NEAR(long_side_y, 50, 1e-9);
  const auto pass = telling_pass(mitred, over.front());
  ASSERT_TRUE(pass.has_value());
}

TEST(Departures, CrossingsThatTell) {
  const auto part = build_template(frame());
  ASSERT_TRUE(part.ok());
  std::vector<Polygon> other = part->members;
  other[kPost] = box({300, 50}, {340, 440});
  std::vector<VisibleEdge> instead;
  for (std::size_t m = 0; m < other.size(); ++m) {
    for (const VisibleEdge& e : visible_edges(other, m)) instead.push_back(e);
  }
  const auto tell = [&](const Vec2& a, const Vec2& b) {
    return crossings_that_tell(part->edges, instead, {a, b});
  };
  EXPECT_EQ(tell({320, 20}, {320, 100}), 2) << "both sides of the slot";
  EXPECT_EQ(tell({280, 45}, {360, 45}), 2) << "the post is not there any more";
  EXPECT_EQ(tell({280, 60}, {360, 60}), 0) << "the post is there either way";
  EXPECT_EQ(tell({301, 20}, {301, 100}), 0) << "too near to the corner of the post";
}

TEST(Departures, APassTakesTheMiddleOfWhereItTells) {
  // Over a slanting side, 20 mm back: a slot that is open over x = 300 and closed from x = 318 on.
  Workpiece w = frame();
  w.members[kLow].outline = {{260, 0}, {800, 0}, {800, 540}};
  const auto part = build_template(*validated(std::move(w)));
  ASSERT_TRUE(part.ok());
  const std::vector<Departure> all = departures(part->members, part->edges, kPost, 20, true);
  const Departure* back = find(all, {0, -1}, -20, part->members[kPost]);
  ASSERT_NE(back, nullptr);
  const auto pass = telling_pass(part->members, *back);
  ASSERT_TRUE(pass.has_value());
  EXPECT_GT(pass->a.x(), 304);
  EXPECT_LT(pass->a.x(), 314);
}

TEST(Departures, PassesThatSettleWhereverThePartLies) {
  const auto part = build_template(frame());
  ASSERT_TRUE(part.ok());
  const std::vector<Departure> all = of(*part, kPost, true);
  const Departure* back = find(all, {0, -1}, -10, part->members[kPost]);
  ASSERT_NE(back, nullptr);
  const std::vector<Segment> near = settling_passes(part->members, *back, {}, 8),
                             far = settling_passes(part->members, *back, {}, 30);
  ASSERT_EQ(near.size(), 1u) << "the post is 40 wide";
  EXPECT_GT(far.size(), 1u);
  EXPECT_TRUE(settling_passes(part->members, *back, near, 8).empty()) << "they are laid already";
  const auto elsewhere = settling_passes(part->members, *back, far, 8);
  EXPECT_LE(elsewhere.size(), 1u);
}

}  // namespace
}  // namespace weldcell::workpiece
