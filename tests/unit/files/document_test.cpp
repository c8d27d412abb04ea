#include "weldcell/files/document.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "weldcell/files/schema.hpp"

namespace weldcell::files {
namespace {

using ::testing::HasSubstr;

std::string fault_of(std::string_view yaml) {
  const auto parsed = parse_document(yaml, "f.yaml");
  const auto* faults = std::get_if<Faults>(&parsed);
  return faults == nullptr ? "" : text(*faults);
}

TEST(Document, KeepsLinesKeysAndQuotes) {
  const auto parsed = parse_document("a: 1\nb:\n  - x\n  - \"2\"\nc: {d: [1, 2]}\ne:\n", "f.yaml");
  ASSERT_TRUE(std::holds_alternative<Node>(parsed)) << text(std::get<Faults>(parsed));
  const Node& top = std::get<Node>(parsed);
  ASSERT_EQ(top.keys.size(), 4u);
  EXPECT_EQ(top.keys[2].line, 5);
  ASSERT_NE(top.find("b"), nullptr);
  EXPECT_EQ(top.find("b")->items[1].line, 4);
  EXPECT_TRUE(top.find("b")->items[1].quoted);
  EXPECT_FALSE(top.find("b")->items[0].quoted);
  EXPECT_EQ(top.find("c")->find("d")->items.size(), 2u);
  EXPECT_EQ(top.find("e")->kind, Node::Kind::Null);
  EXPECT_EQ(top.find("nobody"), nullptr);
}

TEST(Document, RefusesWhatNoHonestFileHolds) {
  EXPECT_THAT(fault_of("a: &x 1\nb: *x\n"), HasSubstr("f.yaml:1: anchors"));
  EXPECT_THAT(fault_of("a: 1\nb: *x\n"), HasSubstr("f.yaml:2"));
  EXPECT_THAT(fault_of("a: !!python/object 1\n"), HasSubstr("f.yaml:1: the tag"));
  EXPECT_THAT(fault_of("a: 1\n---\nb: 2\n"), HasSubstr("second document"));
  EXPECT_THAT(fault_of("a: 1\nb: 2\na: 3\nb: 4\n"), HasSubstr("f.yaml:3: a: stands twice, first in line 1"));
  EXPECT_THAT(fault_of("a: 1\nb: 2\na: 3\nb: 4\n"), HasSubstr("f.yaml:4: b: stands twice, first in line 2"));
  EXPECT_THAT(fault_of("a: [1, 2\n"), HasSubstr("is not valid YAML"));
  EXPECT_THAT(fault_of("a: 1\n b: 2\n"), HasSubstr("f.yaml:2"));
  EXPECT_THAT(fault_of(""), HasSubstr("is empty"));
  EXPECT_THAT(fault_of("just words\n"), HasSubstr("f.yaml:1: holds 'just words'"));
  EXPECT_THAT(fault_of(std::string("a: \0b", 5)), HasSubstr("NUL"));
  EXPECT_THAT(fault_of("? [a]\n: b\n"), HasSubstr("f.yaml:1"));
}

TEST(Document, HasLimits) {
  EXPECT_THAT(fault_of(std::string(kMaxFileBytes + 1, ' ')), HasSubstr("bytes"));
  std::string deep = "a: ";
  for (int i = 0; i < kMaxDepth; ++i) deep += "[";
  EXPECT_THAT(fault_of(deep + "1" + std::string(kMaxDepth, ']')), HasSubstr("nested deeper"));
  EXPECT_THAT(fault_of("a: " + std::string(400'000, '[')), HasSubstr("nested deeper"));
  EXPECT_THAT(fault_of("a: " + std::string(400'000, '{')), HasSubstr("nested deeper"));
  std::string block;
  for (int i = 0; i < 2000; ++i) block += std::string(static_cast<std::size_t>(i % 400), ' ') + "- \n";
  EXPECT_NE(fault_of(block), "");
  std::string many = "a: [";
  for (std::size_t i = 0; i < kMaxNodes; ++i) many += "1,";
  EXPECT_THAT(fault_of(many + "1]"), HasSubstr("more than 200000 values"));
}

TEST(Document, SurvivesEveryTruncationAndAnyByte) {
  const std::string whole =
      "job: demo-017\nworkpiece: ladder.yaml\nplanned: {x_mm: 900, y_mm: 0, theta_deg: 0}\n"
      "inspection:\n  pattern: \"zigzag\"\n  list: [1, 2.5, -3e2]\n";
  int refused = 0;
  for (std::size_t n = 0; n < whole.size(); ++n) refused += fault_of(whole.substr(0, n)).empty() ? 0 : 1;
  EXPECT_GT(refused, 10);
  constexpr unsigned kSeed = 20261122;
  std::mt19937 random(kSeed);
  for (int round = 0; round < 3000; ++round) {
    std::string hurt = whole;
    for (int k = 0; k < 3; ++k) hurt[random() % hurt.size()] = static_cast<char>(random() % 256);
    SCOPED_TRACE("seed " + std::to_string(kSeed) + " round " + std::to_string(round) + "\n" + hurt);
    const auto parsed = parse_document(hurt, "f.yaml");
    if (const auto* faults = std::get_if<Faults>(&parsed)) {
      ASSERT_FALSE(faults->empty());
    } else {
      const Node& top = std::get<Node>(parsed);
      ASSERT_EQ(top.keys.size(), top.items.size());
    }
  }
}

TEST(Schema, SuggestsTheKnownKeyThatIsNearest) {
  const std::vector<std::string> known = {"pattern", "span_mm", "pitch_mm", "speed_mm_s"};
  EXPECT_EQ(nearest_word("patern", known), "pattern");
  EXPECT_EQ(nearest_word("speed", known), "speed_mm_s");
  EXPECT_EQ(nearest_word("pitch_cm", known), "pitch_mm");
  EXPECT_EQ(nearest_word("colour", known), "");
}

double number_of(const std::string& written, std::string& fault) {
  const auto parsed = parse_document("v: " + written + "\n", "f");
  Faults faults;
  Map map(std::get<Node>(parsed), "f", "", faults);
  double value = -7;
  map.number("v", value, {-1000, 1000});
  fault = text(faults);
  return value;
}

TEST(Schema, ReadsNumbersAndNothingElse) {
  std::string fault;
  for (const auto& [written, value] : std::vector<std::pair<std::string, double>>{
           {"1", 1}, {"-2.5", -2.5}, {"+3", 3}, {"1e2", 100}, {".5", 0.5}, {"1000", 1000}}) {
    EXPECT_EQ(number_of(written, fault), value) << written;
    EXPECT_EQ(fault, "");
  }
  for (const char* written :
       {"nan", ".nan", ".NaN",  "inf", "-.inf",  "+inf", "1e999", "1001", "-1000.1", "12mm",
        "1,5", "0x10", "\"1\"", "[1]", "{a: 1}", "true", "~",     "''",   "1_000",   "++1"}) {
    EXPECT_EQ(number_of(written, fault), -7) << written;
    EXPECT_THAT(fault, HasSubstr("f:1: v: ")) << written;
  }
}

}  // namespace
}  // namespace weldcell::files
