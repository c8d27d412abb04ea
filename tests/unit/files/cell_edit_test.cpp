#include "weldcell/files/cell_edit.hpp"

#include <gtest/gtest.h>

#include "weldcell/files/cell_file.hpp"
#include "weldcell/files/document.hpp"

namespace weldcell::files {
namespace {

TEST(CellEdit, ChangesOnlyItsKeysAndKeepsComments) {
  const std::string before =
      "a: 1  # one\nlaser:\n  # head\n  latency_ms: 2.7    # (default) comment\n  spot_mm: 1\ntable: {z: "
      "1}\n";
  const auto after = with_keys(before, "laser", {{"latency_ms", "2.75"}, {"measured", "{x: 1}"}});
  ASSERT_TRUE(after.ok()) << after.error().text();
  EXPECT_EQ(*after,
            "a: 1  # one\nlaser:\n  # head\n  latency_ms: 2.75   # (default) comment\n  measured: {x: 1}\n"
            "  spot_mm: 1\ntable: {z: 1}\n");
  const auto again = with_keys(*after, "laser", {{"measured", "{x: 2}"}});
  ASSERT_TRUE(again.ok());
  EXPECT_NE(again->find("  measured: {x: 2}\n"), std::string::npos);
  EXPECT_EQ(again->find("x: 1}\n  spot"), std::string::npos);
}

TEST(CellEdit, RefusesASectionInBracesOrAbsent) {
  EXPECT_FALSE(with_keys("laser: {a: 1}\n", "laser", {{"a", "2"}}).ok());
  EXPECT_FALSE(with_keys("table:\n  z: 1\n", "laser", {{"a", "2"}}).ok());
}

TEST(CellFile, ALatencyUnderOtherConditionsIsRefusedWithItsLine) {
  const std::string path = std::string(WELDCELL_CONFIG) + "/cell-demo.yaml";
  const auto text = read_text_file(path);
  ASSERT_TRUE(std::holds_alternative<std::string>(text));
  const auto parse = [&](const std::string& conditions) {
    const auto changed = with_keys(std::get<std::string>(text), "laser", {{"latency_measured", conditions}});
    EXPECT_TRUE(changed.ok()) << changed.error().text();
    return parse_cell(*changed, "cell.yaml", std::string(WELDCELL_CONFIG) + "/robots");
  };
  const auto same = parse(
      "{date: \"2026-01-01T00:00:00Z\", rate_hz: 5000, dialect: meas28, filter: none, robot: "
      "irb2600_12_185}");
  if (const auto* faults = std::get_if<Faults>(&same)) FAIL() << files::text(*faults);
  const auto other =
      parse("{date: x, rate_hz: 1500, dialect: meas28, filter: median 3, robot: irb2600_12_185}");
  const auto* faults = std::get_if<Faults>(&other);
  ASSERT_NE(faults, nullptr);
  ASSERT_EQ(faults->size(), 2U);
  EXPECT_EQ((*faults)[0].key, "laser.latency_measured.rate_hz");
  EXPECT_EQ((*faults)[1].key, "laser.latency_measured.filter");
  EXPECT_GT((*faults)[0].line, 20);
  // Who measures anew must be able to read it.
  const auto changed =
      with_keys(std::get<std::string>(text), "laser",
                {{"latency_measured",
                  "{date: x, rate_hz: 1500, dialect: data28, filter: none, robot: irb2600_12_185}"}});
  ASSERT_TRUE(changed.ok());
  const std::string robots = std::string(WELDCELL_CONFIG) + "/robots";
  EXPECT_TRUE(std::holds_alternative<Faults>(parse_cell(*changed, "cell.yaml", robots)));
  EXPECT_TRUE(
      std::holds_alternative<CellConfig>(parse_cell(*changed, "cell.yaml", robots, StaleLatency::Taken)));
}

}  // namespace
}  // namespace weldcell::files
