#include "weldcell/files/edge_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace weldcell::files {
namespace {

using ::testing::HasSubstr;

std::string faults_of(std::string_view csv) {
  const auto parsed = parse_edges(csv, "e.csv");
  return std::holds_alternative<Faults>(parsed) ? text(std::get<Faults>(parsed)) : "";
}

TEST(EdgeFile, ReadsColumnsInAnyOrderAndOptionalOnes) {
  const auto parsed =
      parse_edges("\r\nstep,x_mm, y_mm ,dir_x,dir_y\r\n# note\n+1,10,20.5,1,0\r\n-1,-3e1,0,0,0\n", "e.csv");
  ASSERT_TRUE(std::holds_alternative<EdgeSet>(parsed)) << text(std::get<Faults>(parsed));
  const auto& e = std::get<EdgeSet>(parsed).edges;
  ASSERT_EQ(e.size(), 2u);
  EXPECT_EQ(e[0].step, 1);
  EXPECT_DOUBLE_EQ(e[0].y_mm, 20.5);
  EXPECT_DOUBLE_EQ(e[0].sigma_mm, 0);
  EXPECT_DOUBLE_EQ(e[1].x_mm, -30);
  EXPECT_DOUBLE_EQ(e[1].dir_x, 0);
}

TEST(EdgeFile, HeightsBesideAnEdgeMayBeUnknown) {
  const auto parsed = parse_edges(
      "x_mm,y_mm,dir_x,dir_y,step,top_z_mm,table_z_mm\n1,2,1,0,1,52.5,\n1,2,1,0,1,,\n1,2,1,0,1,nan,12\n",
      "e.csv");
  ASSERT_TRUE(std::holds_alternative<Faults>(parsed));
  EXPECT_THAT(text(std::get<Faults>(parsed)), HasSubstr("e.csv:4: top_z_mm: 'nan' is not a finite number"));
  const auto sound =
      parse_edges("x_mm,y_mm,dir_x,dir_y,step,top_z_mm,table_z_mm\n1,2,1,0,1,52.5,\n1,2,1,0,1,,\n", "e.csv");
  ASSERT_TRUE(std::holds_alternative<EdgeSet>(sound)) << text(std::get<Faults>(sound));
  const auto& set = std::get<EdgeSet>(sound);
  ASSERT_EQ(set.top_z_mm.size(), 2u);
  EXPECT_DOUBLE_EQ(set.top_z_mm[0], 52.5);
  EXPECT_TRUE(std::isnan(set.top_z_mm[1]));
  EXPECT_TRUE(set.table_z_mm.empty()) << "a column without a height is as none";
  const std::string again = edges_csv(set.edges, set.top_z_mm, set.table_z_mm);
  EXPECT_THAT(again, HasSubstr(",top_z_mm\n"));
  EXPECT_THAT(again, HasSubstr(",52.5000\n"));
  const auto back = parse_edges(again, "e.csv");
  ASSERT_TRUE(std::holds_alternative<EdgeSet>(back)) << again;
  EXPECT_TRUE(std::isnan(std::get<EdgeSet>(back).top_z_mm[1]));
}

TEST(EdgeFile, SaysEachFaultWithItsLine) {
  const std::string header = "x_mm,y_mm,dir_x,dir_y,step\n";
  EXPECT_THAT(faults_of(""), HasSubstr("e.csv: is empty"));
  EXPECT_THAT(faults_of("x_mm,y_mm,dir_x,dir_y\n"), HasSubstr("e.csv:1: step: the column is missing"));
  EXPECT_THAT(faults_of("x_mm,y_mm,dir_x,dir_y,step,sigma\n"),
              HasSubstr("sigma: unknown column: did you mean 'sigma_mm'?"));
  EXPECT_THAT(faults_of("x_mm,x_mm,y_mm,dir_x,dir_y,step\n"), HasSubstr("x_mm: stands twice"));
  const std::string found =
      faults_of(header + "1,2,1,0,1\nnan,2,1,0,1\n1,2,1,0,2\n1,2,1,1,1\n1,2,1,0\n1,x,1,0,1\n1e7,0,1,0,1\n");
  EXPECT_THAT(found, HasSubstr("e.csv:3: x_mm: 'nan' is not a finite number"));
  EXPECT_THAT(found, HasSubstr("e.csv:4: step: 2 is no step"));
  EXPECT_THAT(found, HasSubstr("e.csv:5: dir_x: the direction has length 1.4142"));
  EXPECT_THAT(found, HasSubstr("e.csv:6: has 4 fields: the header has 5"));
  EXPECT_THAT(found, HasSubstr("e.csv:7: y_mm: 'x' is not a finite number"));
  EXPECT_THAT(found, HasSubstr("e.csv:8: x_mm: '1e7' is out of range"));
}

TEST(EdgeFile, TakesAByteOrderMarkAndShowsNoControlCharacters) {
  EXPECT_EQ(faults_of("\xEF\xBB\xBFx_mm,y_mm,dir_x,dir_y,step\n1,2,1,0,1\n"), "");
  const std::string header = "x_mm,y_mm,dir_x,dir_y,step\n";
  EXPECT_THAT(faults_of(header + "\x1b[31m,2,1,0,1\n"), HasSubstr("e.csv:2: x_mm: '?[31m' is not a finite"));
  EXPECT_THAT(faults_of("\x1b[2J\x01\n1\n"), HasSubstr("e.csv:1: ?[2J?: unknown column"));
  EXPECT_THAT(faults_of(header + std::string(90, '9') + ",2,1,0,1\n"),
              HasSubstr("x_mm: '" + std::string(40, '9') + "...' is out of range"));
  EXPECT_THAT(faults_of(header + "1,2,1,0,1,\n"), HasSubstr("e.csv:2: has 6 fields: the header has 5"));
}

TEST(EdgeFile, NegativeSigmaAndSpeedAreNamed) {
  const std::string header = "x_mm,y_mm,dir_x,dir_y,step,sigma_mm,speed_mm_s\n";
  EXPECT_THAT(faults_of(header + "1,2,1,0,1,-0.3,200\n"),
              HasSubstr("e.csv:2: sigma_mm: is negative: 0 = unknown"));
  EXPECT_THAT(faults_of(header + "1,2,1,0,1,0.3,-200\n"), HasSubstr("e.csv:2: speed_mm_s: is negative"));
  EXPECT_THAT(faults_of(header + "1,2,1,0,1,inf,200\n"), HasSubstr("sigma_mm: 'inf' is not a finite number"));
  EXPECT_THAT(faults_of(header + "1,2,1,0,1,,200\n"), HasSubstr("sigma_mm: '' is not a finite number"));
}

TEST(EdgeFile, MoreThanAMillionRowsAreRefused) {
  std::string csv = "x_mm,y_mm,dir_x,dir_y,step\n";
  for (int i = 0; i < 1'000'000; ++i) csv += "1,2,1,0,1\n";
  EXPECT_EQ(faults_of(csv), "");
  EXPECT_THAT(faults_of(csv + "1,2,1,0,1\n"), HasSubstr("more than 1000000 rows: split the file"));
}

TEST(EdgeFile, StopsAfterFiftyFaults) {
  std::string csv = "x_mm,y_mm,dir_x,dir_y,step\n";
  for (int i = 0; i < 1000; ++i) csv += "x,2,1,0,1\n";
  const auto parsed = parse_edges(csv, "e.csv");
  ASSERT_TRUE(std::holds_alternative<Faults>(parsed));
  EXPECT_EQ(std::get<Faults>(parsed).size(), 50u);
}

TEST(EdgeFile, WhatIsPrintedReadsBackTheSame) {
  constexpr unsigned kSeed = 11;
  std::mt19937 random(kSeed);
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  for (int round = 0; round < 100; ++round) {
    SCOPED_TRACE("seed " + std::to_string(kSeed) + " round " + std::to_string(round));
    std::vector<EdgePoint> edges;
    std::vector<PathPiece> path;
    for (unsigned i = 0; i < random() % 40; ++i) {
      const double a = uniform(-4, 4);
      const bool known = random() % 4 != 0;
      edges.push_back({uniform(-2000, 2000), uniform(-2000, 2000), known ? std::cos(a) : 0,
                       known ? std::sin(a) : 0, static_cast<int>(random() % 3) - 1, uniform(0, 2),
                       uniform(0, 500), random() % 8 == 0});
      path.push_back({uniform(-9, 9), uniform(-9, 9), uniform(-9, 9), uniform(-9, 9)});
    }
    const std::string csv = edges_csv(edges);
    const auto parsed = parse_edges(csv, "e.csv");
    ASSERT_TRUE(std::holds_alternative<EdgeSet>(parsed)) << csv << text(std::get<Faults>(parsed));
    const auto& back = std::get<EdgeSet>(parsed).edges;
    ASSERT_EQ(back.size(), edges.size());
    for (std::size_t i = 0; i < edges.size(); ++i) {
      EXPECT_NEAR(back[i].x_mm, edges[i].x_mm, 6e-5);
      EXPECT_NEAR(back[i].dir_x, edges[i].dir_x, 2e-6);
      EXPECT_EQ(back[i].step, edges[i].step);
      EXPECT_NEAR(back[i].sigma_mm, edges[i].sigma_mm, 6e-5);
      EXPECT_EQ(back[i].shadowed, edges[i].shadowed);
    }
    const auto paths = parse_path(path_csv(path), "p.csv");
    ASSERT_TRUE(std::holds_alternative<std::vector<PathPiece>>(paths));
    ASSERT_EQ(std::get<std::vector<PathPiece>>(paths).size(), path.size());
  }
}

}  // namespace
}  // namespace weldcell::files
