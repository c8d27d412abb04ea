#include "weldcell/files/workpiece_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "weldcell/base/units.hpp"
#include "weldcell/files/yaml_text.hpp"

namespace weldcell::files {
namespace {

using ::testing::HasSubstr;

std::string faults_of(std::string_view yaml) {
  const auto parsed = parse_workpiece(yaml, "w.yaml");
  return std::holds_alternative<Faults>(parsed) ? text(std::get<Faults>(parsed)) : "";
}

workpiece::Workpiece read(std::string_view yaml) {
  auto parsed = parse_workpiece(yaml, "w.yaml");
  EXPECT_TRUE(std::holds_alternative<workpiece::Workpiece>(parsed)) << faults_of(yaml);
  return std::holds_alternative<Faults>(parsed) ? workpiece::Workpiece{}
                                                : std::get<workpiece::Workpiece>(std::move(parsed));
}

TEST(WorkpieceFile, ReadsTheLadder) {
  const auto parsed = read_workpiece_file(std::string(WELDCELL_CONFIG) + "/workpieces/ladder.yaml");
  ASSERT_TRUE(std::holds_alternative<workpiece::Workpiece>(parsed)) << text(std::get<Faults>(parsed));
  const auto& w = std::get<workpiece::Workpiece>(parsed);
  EXPECT_EQ(w.members.size(), 6u);
  EXPECT_EQ(w.welds.size(), 8u);
  EXPECT_DOUBLE_EQ(w.members[0].edge_radius_mm, 4);
  EXPECT_DOUBLE_EQ(w.welds[0].tolerance_mm, 0.6);
}

TEST(WorkpieceFile, UnitsScaleCoordinatesButNotKeysThatNameTheirUnit) {
  const workpiece::Workpiece w = read(
      "workpiece:\n  name: plate\n  units: inch\n  height_mm: 12\n  members:\n"
      "    - {name: p, outline: [[0, 0], [10, 0], [10, 2], [0, 2]], edge_radius_mm: 1}\n"
      "    - {name: q, tag: Q, outline: [[0, 2], [10, 2], [10, 4], [0, 4]]}\n"
      "  fixtures: [{x: 1, y: 5, diameter_mm: 30, member: q}]\n"
      "  welds:\n    - {name: w, joins: [p, q], path: [[0, 2, 0.5], {via: [5, 2, 0.5], to: [10, 2, 0.5]}], "
      "work_angle_deg: 45}\n");
  ASSERT_EQ(w.members.size(), 2u);
  EXPECT_NEAR(bounds(w.members[0].outline).max.x(), 254, 1e-9);
  EXPECT_DOUBLE_EQ(w.members[0].edge_radius_mm, 1);
  EXPECT_EQ(w.members[0].tag, "1");
  EXPECT_EQ(w.members[1].tag, "Q");
  EXPECT_NEAR(w.fixtures[0].x_mm, 25.4, 1e-9);
  EXPECT_DOUBLE_EQ(w.fixtures[0].diameter_mm, 30);
  EXPECT_TRUE(w.welds[0].pieces[0].arc);
  EXPECT_NEAR(w.welds[0].pieces[0].via.x(), 127, 1e-9);
  EXPECT_NEAR(w.welds[0].work_angle_rad, kPi / 4, 1e-12);
}

TEST(WorkpieceFile, EveryFaultHasItsLine) {
  const std::string found = faults_of(
      "workpiece:\n  name: bad\n  units: cm\n  height_mm: -3\n  members:\n"
      "    - {name: a, outline: [[0, 0], [10, 0], [10, 10], [0, 10]]}\n"
      "    - {name: a, outline: [[0, 0], [10, 0]]}\n"
      "    - {name: bow, outline: [[0, 0], [50, 50], [50, 0], [0, 50]]}\n"
      "    - {name: nan, outline: [[0, .nan], [50, 50], [50, 0]]}\n"
      "  welds:\n"
      "    - {name: w1, joins: [a, bows], path: [[0, 0, 0], [1, 1, 1]], tolerance: 3}\n");
  EXPECT_THAT(found, HasSubstr("w.yaml:3: units: 'cm' is no choice: one of mm, inch, m"));
  EXPECT_THAT(found, HasSubstr("w.yaml:4: height_mm: -3 is out of range"));
  EXPECT_THAT(found, HasSubstr("w.yaml:7: members[1].name: two members are named 'a'"));
  EXPECT_THAT(found, HasSubstr("w.yaml:8: members[2]: "));
  EXPECT_THAT(found, HasSubstr("w.yaml:9: members[3].outline[0]: '.nan' is not finite"));
  EXPECT_THAT(found, HasSubstr("w.yaml:11: welds[0].joins: no member is named 'bows': did you mean 'bow'?"));
  EXPECT_THAT(found, HasSubstr("w.yaml:11: welds[0].tolerance: unknown key: did you mean 'tolerance_mm'?"));
}

/// A random but sound workpiece: members side by side, seams on their contact lines.
workpiece::Workpiece random_workpiece(std::mt19937& random) {
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  const char* const names[] = {"rail",        "1",       "true", "a b",   "quo\"te",
                               "back\\slash", "Ständer", "x: y", "#hash", "-dash"};
  workpiece::Workpiece w;
  w.name = names[random() % 10];
  w.height_mm = uniform(1, 100);
  const int count = 1 + static_cast<int>(random() % 6);
  double x = uniform(-500, 500);
  for (int i = 0; i < count; ++i) {
    const double wide = uniform(10, 60), high = uniform(50, 400);
    workpiece::Member m;
    m.name = std::string(names[random() % 10]) + std::to_string(i);
    m.tag = std::to_string(i + 1);
    m.outline = {{x, 0}, {x + wide, uniform(-3, 3)}, {x + wide, high}, {x, high}};
    m.edge_radius_mm = random() % 2 == 0 ? 0 : uniform(0.5, 4);
    w.members.push_back(m);
    if (i > 0) {
      workpiece::Weld weld;
      weld.name = "w" + std::to_string(i);
      weld.joins = {w.members[static_cast<std::size_t>(i) - 1].name, m.name};
      weld.start = {x, 5, w.height_mm};
      weld.pieces.push_back({false, Eigen::Vector3d::Zero(), {x, 20, w.height_mm}});
      if (random() % 2 == 0) weld.pieces.push_back({true, {x + 1, 25, w.height_mm}, {x, 30, w.height_mm}});
      weld.tolerance_mm = uniform(0.1, 2);
      weld.work_angle_rad = uniform(-1, 1);
      weld.travel_angle_rad = uniform(-0.5, 0.5);
      w.welds.push_back(weld);
    }
    if (random() % 2 == 0) w.fixtures.push_back({x - 20, uniform(0, 40), uniform(20, 60), m.name});
    x += wide;
  }
  return w;
}

void expect_same(const workpiece::Workpiece& a, const workpiece::Workpiece& b) {
  constexpr double kPrinted = 1e-6;
  EXPECT_EQ(a.name, b.name);
  EXPECT_NEAR(a.height_mm, b.height_mm, kPrinted);
  ASSERT_EQ(a.members.size(), b.members.size());
  for (std::size_t i = 0; i < a.members.size(); ++i) {
    EXPECT_EQ(a.members[i].name, b.members[i].name);
    EXPECT_EQ(a.members[i].tag, b.members[i].tag);
    EXPECT_NEAR(a.members[i].edge_radius_mm, b.members[i].edge_radius_mm, kPrinted);
    ASSERT_EQ(a.members[i].outline.size(), b.members[i].outline.size());
    for (std::size_t k = 0; k < a.members[i].outline.size(); ++k) {
      EXPECT_LT((a.members[i].outline[k] - b.members[i].outline[k]).norm(), 2 * kPrinted);
    }
  }
  ASSERT_EQ(a.fixtures.size(), b.fixtures.size());
  for (std::size_t i = 0; i < a.fixtures.size(); ++i) EXPECT_EQ(a.fixtures[i].member, b.fixtures[i].member);
  ASSERT_EQ(a.welds.size(), b.welds.size());
  for (std::size_t i = 0; i < a.welds.size(); ++i) {
    EXPECT_EQ(a.welds[i].joins, b.welds[i].joins);
    EXPECT_NEAR(a.welds[i].work_angle_rad, b.welds[i].work_angle_rad, kPrinted);
    ASSERT_EQ(a.welds[i].pieces.size(), b.welds[i].pieces.size());
    for (std::size_t k = 0; k < a.welds[i].pieces.size(); ++k) {
      EXPECT_EQ(a.welds[i].pieces[k].arc, b.welds[i].pieces[k].arc);
      EXPECT_LT((a.welds[i].pieces[k].to - b.welds[i].pieces[k].to).norm(), 2 * kPrinted);
    }
  }
}

TEST(WorkpieceFile, WhatIsPrintedReadsBackTheSame) {
  constexpr unsigned kSeed = 7;
  std::mt19937 random(kSeed);
  for (int round = 0; round < 300; ++round) {
    const workpiece::Workpiece first = random_workpiece(random);
    const std::string yaml = workpiece_yaml(first);
    SCOPED_TRACE("seed " + std::to_string(kSeed) + " round " + std::to_string(round) + "\n" + yaml);
    const workpiece::Workpiece second = read(yaml);
    expect_same(first, second);
    ASSERT_EQ(workpiece_yaml(second), yaml);
    if (HasFailure()) return;
  }
}

TEST(YamlText, QuotesWhatYamlWouldReadAsSomethingElse) {
  EXPECT_EQ(yaml_text("rail_L"), "rail_L");
  EXPECT_EQ(yaml_text("1"), "\"1\"");
  EXPECT_EQ(yaml_text("true"), "\"true\"");
  EXPECT_EQ(yaml_text("a\"b\\c"), "\"a\\\"b\\\\c\"");
  EXPECT_EQ(yaml_number(-0.0000001), "0");
  EXPECT_EQ(yaml_number(40), "40");
  EXPECT_EQ(yaml_number(100.5), "100.5");
  EXPECT_EQ(yaml_number(-1e-6), "-0.000001");
}

}  // namespace
}  // namespace weldcell::files
