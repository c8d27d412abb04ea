#include "weldcell/files/job_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "weldcell/base/units.hpp"

namespace weldcell::files {
namespace {

using ::testing::HasSubstr;

std::string faults_of(std::string_view yaml) {
  const auto parsed = parse_job(yaml, "j.yaml");
  return std::holds_alternative<Faults>(parsed) ? text(std::get<Faults>(parsed)) : "";
}

TEST(JobFile, ReadsEveryKey) {
  const std::string sha(64, 'a');
  const auto parsed = parse_job(
      "job: demo-017\nnumber: 17\nworkpiece: part.DXF\nrevision: sha256:" + sha +
          "\ncad: {units: inch, height_mm: 40, edge_radius_mm: 4, drawn: flat}\n"
          "planned: {x_mm: 900, y_mm: -1.5, theta_deg: 90}\nguidance: {enabled: false}\n"
          "inspection: {pattern: spiral, span_mm: 81, pitch_mm: 41, speed_mm_s: 201, margin_mm: 16, "
          "margin_deg: 20, passes_per_member: 4}\n"
          "acceptance: {max_mean_error_mm: 2, max_offset_mm: 40, max_rotation_deg: 10}\n"
          "weld: {execute: false}\n",
      "j.yaml");
  ASSERT_TRUE(std::holds_alternative<job::JobOrder>(parsed)) << text(std::get<Faults>(parsed));
  const auto& j = std::get<job::JobOrder>(parsed);
  EXPECT_EQ(j.name, "demo-017");
  EXPECT_EQ(j.number, 17);
  EXPECT_EQ(j.workpiece_file, "part.DXF");
  EXPECT_EQ(j.revision, "sha256:" + sha);
  EXPECT_EQ(j.cad.units, "inch");
  EXPECT_DOUBLE_EQ(j.cad.height_mm, 40);
  EXPECT_DOUBLE_EQ(j.cad.edge_radius_mm, 4);
  EXPECT_EQ(j.cad.drawn, "flat");
  ASSERT_TRUE(j.planned.has_value());
  EXPECT_NEAR(j.planned->theta_rad, kPi / 2, 1e-12);
  EXPECT_FALSE(j.guidance);
  EXPECT_EQ(j.inspection.pattern, plan::Pattern::Spiral);
  EXPECT_DOUBLE_EQ(j.inspection.span_mm, 81);
  EXPECT_DOUBLE_EQ(j.inspection.pitch_mm, 41);
  EXPECT_DOUBLE_EQ(j.inspection.speed_mm_s, 201);
  EXPECT_DOUBLE_EQ(j.inspection.margin_mm, 16);
  EXPECT_NEAR(j.inspection.margin_rad, rad(20), 1e-12);
  EXPECT_EQ(j.inspection.passes_per_member, 4);
  EXPECT_NEAR(j.acceptance.max_rotation_rad, rad(10), 1e-12);
  EXPECT_DOUBLE_EQ(j.acceptance.max_offset_mm, 40);
  EXPECT_FALSE(j.execute_weld);
}

TEST(JobFile, TheShortestJobHasTheDefaultsOfTheStruct) {
  const auto parsed = parse_job("job: a\nworkpiece: w.yaml\n", "j.yaml");
  ASSERT_TRUE(std::holds_alternative<job::JobOrder>(parsed));
  const auto& j = std::get<job::JobOrder>(parsed);
  EXPECT_FALSE(j.planned.has_value());
  EXPECT_TRUE(j.guidance);
  EXPECT_TRUE(j.execute_weld);
  EXPECT_DOUBLE_EQ(j.inspection.speed_mm_s, plan::Inspection{}.speed_mm_s);
}

TEST(JobFile, ReadsTheDemoJobs) {
  for (const char* name : {"demo-ladder", "demo-mitre"}) {
    const auto parsed = read_job_file(std::string(WELDCELL_CONFIG) + "/jobs/" + name + ".yaml");
    ASSERT_TRUE(std::holds_alternative<job::JobOrder>(parsed)) << text(std::get<Faults>(parsed));
    EXPECT_EQ(std::get<job::JobOrder>(parsed).name, name);
  }
}

TEST(JobFile, SaysEverythingAtOnce) {
  const std::string found = faults_of(
      "job: ../etc\nworkpiece: part.pdf\nrevision: sha256:xyz\ninspection:\n  patern: zigzag\n  speed_mm_s: "
      "fast\n"
      "planned: {x_mm: 1}\nweld: {execute: yes}\nguidance: on\ncad: {units: cm}\n");
  EXPECT_THAT(found, HasSubstr("j.yaml:1: job: '../etc' cannot name a folder"));
  EXPECT_THAT(found, HasSubstr("j.yaml:2: workpiece: 'part.pdf' is no file that can be read"));
  EXPECT_THAT(found, HasSubstr("j.yaml:3: revision: is no SHA-256"));
  EXPECT_THAT(found, HasSubstr("j.yaml:5: inspection.patern: unknown key: did you mean 'pattern'?"));
  EXPECT_THAT(found, HasSubstr("j.yaml:6: inspection.speed_mm_s: is 'fast', not a number"));
  EXPECT_THAT(found, HasSubstr("j.yaml:7: planned.y_mm: is missing: add 'y_mm:'"));
  EXPECT_THAT(found, HasSubstr("j.yaml:8: weld.execute: is 'yes': write true or false"));
  EXPECT_THAT(found, HasSubstr("j.yaml:9: guidance: is 'on': write keys and values here"));
  EXPECT_THAT(found, HasSubstr("j.yaml:10: cad.units: 'cm' is no choice: one of mm, inch, m"));
  EXPECT_THAT(faults_of("{}"), HasSubstr("job: is missing"));
}

}  // namespace
}  // namespace weldcell::files
