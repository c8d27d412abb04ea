#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "frame.hpp"
#include "guidance/lens.hpp"
#include "weldcell/guidance/drawing.hpp"

namespace weldcell::guidance {
namespace {

using ::testing::HasSubstr;

cell::CellSetup cell_with_lens(double k1 = 0, double k2 = 0) {
  cell::CellSetup c;
  c.projector.k1 = k1;
  c.projector.k2 = k2;
  return c;
}

void expect_inside(const Drawing& d) {
  for (const PixelLine& l : d.lines) {
    ASSERT_GE(l.px.size(), 2u);
    for (const Vec2& p : l.px) {
      EXPECT_GE(p.minCoeff(), -1e-6);
      EXPECT_LE(p.x(), d.width_px + 1e-6);
      EXPECT_LE(p.y(), d.height_px + 1e-6);
    }
  }
  for (const PixelText& t : d.texts) {
    EXPECT_GE(t.px.y() - t.height_px / 2, 0) << t.text;
    EXPECT_LE(t.px.y() + t.height_px / 2, d.height_px) << t.text;
  }
}

Drawing rung(const cell::CellSetup& cell, double height_mm = 800) {
  const auto w = test::ladder();
  const Pose2 planned{900, 0, 0};
  const auto steps = guide_steps(w, planned);
  return draw_step(cell, w, planned, steps, 2,
                   test::looking_down(steps[2].centre_base_mm, height_mm, cell.table.z_mm));
}

TEST(Lens, IsTheTextbookPinhole) {
  const auto cell = cell_with_lens(-0.1, 0.02);
  const Lens lens(cell.projector, test::looking_down({900, 0}, 800, 500));
  const auto centre = lens.pixel({900, 0, 500});
  ASSERT_TRUE(centre);
  EXPECT_LT((*centre - Vec2(424, 240)).norm(), 1e-9);
  const auto p = lens.pixel({980, -40, 500});  // n = (0.1, 0.05)
  ASSERT_TRUE(p);
  const double r2 = 0.0125, bend = 1 - 0.1 * r2 + 0.02 * r2 * r2;
  EXPECT_NEAR(p->x(), 424 + 1071 * 0.1 * bend, 1e-9);
  EXPECT_NEAR(p->y(), 240 + 1071 * 0.05 * bend, 1e-9);
  EXPECT_FALSE(lens.pixel({900, 0, 1400})) << "behind the projector";
  EXPECT_FALSE(lens.pixel({5000, 0, 500})) << "far aside";
}

TEST(Clip, AgreesWithSamplingOnRandomSegments) {
  constexpr std::uint64_t kSeed = 20282;
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> place(-150, 250);
  int cut = 0, gone = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const Vec2 a(place(random), place(random)), b(place(random), place(random));
    Vec2 c = a, d = b;
    const bool left = clip(c, d, 100, 80);
    const auto inside = [](const Vec2& p) { return p.x() >= 0 && p.x() <= 100 && p.y() >= 0 && p.y() <= 80; };
    double shown = 0;
    constexpr int kSamples = 2000;
    for (int s = 0; s < kSamples; ++s) shown += inside(a + (b - a) * ((s + 0.5) / kSamples));
    const double expected = shown / kSamples * (b - a).norm();
    EXPECT_NEAR(left ? (d - c).norm() : 0, expected, 0.5) << a.transpose() << " -> " << b.transpose();
    gone += !left;
    cut += left && (d - c).norm() < (b - a).norm() - 1e-9;
  }
  EXPECT_GT(cut, 300);
  EXPECT_GT(gone, 300);
}

TEST(DrawStep, ShowsTheMemberItsFixturesAndItsNumber) {
  const Drawing d = rung(cell_with_lens());
  expect_inside(d);
  int outlines = 0, centre_lines = 0, fixtures = 0, placed = 0;
  for (const PixelLine& l : d.lines) {
    outlines += l.colour == Colour::Place && l.closed;
    centre_lines += l.colour == Colour::Place && !l.closed;
    fixtures += l.colour == Colour::Fixture && l.closed;
    placed += l.colour == Colour::Placed;
  }
  EXPECT_EQ(outlines, 1);
  EXPECT_EQ(centre_lines, 1);
  EXPECT_EQ(fixtures, 2);
  EXPECT_GE(placed, 2);
  ASSERT_GE(d.texts.size(), 2u);
  EXPECT_EQ(d.texts[0].text, "3");
  EXPECT_GE(d.texts[0].height_px, 48);
  EXPECT_EQ(d.texts[1].text, "Place member 3: rung_1");
  for (const PixelText& t : d.texts) EXPECT_NE(t.colour, Colour::Warning) << t.text;
}

TEST(DrawStep, DrawsTrueToScaleOnTheTable) {
  const Drawing d = rung(cell_with_lens());
  for (const PixelLine& l : d.lines) {
    if (l.colour != Colour::Place || !l.closed) continue;
    Vec2 low(1e9, 1e9), high(-1e9, -1e9);
    for (const Vec2& p : l.px) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    EXPECT_NEAR(high.x() - low.x(), 40 * 1071 / 800.0, 1e-6);
    EXPECT_NEAR(high.y() - low.y(), 160 * 1071 / 800.0, 1e-6);
  }
}

TEST(DrawStep, BendsLinesWithTheLens) {
  const Drawing straight = rung(cell_with_lens()), bent = rung(cell_with_lens(0.3, 0.1));
  double largest = 0;
  ASSERT_EQ(straight.lines.size(), bent.lines.size());
  for (std::size_t i = 0; i < straight.lines.size(); ++i) {
    if (straight.lines[i].px.size() != bent.lines[i].px.size()) continue;
    for (std::size_t k = 0; k < straight.lines[i].px.size(); ++k) {
      largest = std::max(largest, (straight.lines[i].px[k] - bent.lines[i].px[k]).norm());
    }
  }
  EXPECT_GT(largest, 0.5);
}

TEST(DrawStep, SaysWhenTheMemberRunsOutOfThePicture) {
  const auto cell = cell_with_lens();
  auto w = test::ladder();
  w.members[0] = test::rectangle("rail_A", "1", 0, 0, 1200, 40);
  const auto steps = guide_steps(w, {500, 0, 0});
  const auto d =
      draw_step(cell, w, {500, 0, 0}, steps, 0, test::looking_down(steps[0].centre_base_mm, 600, 500));
  expect_inside(d);
  bool noted = false;
  for (const PixelText& t : d.texts) {
    if (t.colour == Colour::Warning) {
      EXPECT_THAT(t.text, HasSubstr("rail_A runs out of the picture"));
      noted = true;
    }
  }
  EXPECT_TRUE(noted);
  const auto away = draw_step(cell, w, {500, 0, 0}, steps, 0, test::looking_down({500, 2000}, 600, 500));
  expect_inside(away);
  EXPECT_THAT(away.texts.back().text, HasSubstr("outside the picture"));
}

TEST(DrawStep, KeepsTextsOffTheMembersAndFixtures) {
  const auto cell = cell_with_lens();
  const Drawing d = rung(cell);
  const Lens lens(cell.projector,
                  test::looking_down(guide_steps(test::ladder(), {900, 0, 0})[2].centre_base_mm, 800, 500));
  for (const auto& m : test::ladder().members) {
    Polygon px;
    for (const Vec2& p : m.outline) {
      const Vec2 base = Pose2{900, 0, 0} * p;
      const auto at = lens.pixel({base.x(), base.y(), 500});
      ASSERT_TRUE(at);
      px.push_back(*at);
    }
    for (const PixelText& t : d.texts) EXPECT_FALSE(contains(px, t.px)) << t.text << " over " << m.name;
  }
  for (std::size_t a = 0; a < d.texts.size(); ++a) {
    for (std::size_t b = a + 1; b < d.texts.size(); ++b)
      EXPECT_GT((d.texts[a].px - d.texts[b].px).norm(), 20);
  }
}

TEST(DrawStep, PastTheLastStepShowsWhatLies) {
  const auto cell = cell_with_lens();
  const auto w = test::ladder();
  const auto steps = guide_steps(w, {900, 0, 0});
  const auto d =
      draw_step(cell, w, {900, 0, 0}, steps, steps.size(), test::looking_down({1100, 120}, 900, 500));
  for (const PixelLine& l : d.lines) EXPECT_EQ(l.colour, Colour::Placed);
  EXPECT_EQ(d.lines.size(), 4u);
}

TEST(DrawingSvg, EscapesTextsAndKeepsTheSize) {
  Drawing d;
  d.width_px = 848;
  d.height_px = 480;
  d.lines = {{{{1, 2}, {3, 4}}, true, 3, Colour::Place}};
  d.texts = {{{10, 20}, "<b>&\"", 20, Colour::Text}};
  const std::string svg = drawing_svg(d);
  EXPECT_THAT(svg, HasSubstr("&lt;b&gt;&amp;&quot;"));
  EXPECT_THAT(svg, HasSubstr("width=\"848\" height=\"480\""));
  EXPECT_THAT(svg, HasSubstr("<polygon points=\"1.0,2.0 3.0,4.0\""));
  EXPECT_THAT(svg, ::testing::Not(HasSubstr("<b>")));
}

}  // namespace
}  // namespace weldcell::guidance
