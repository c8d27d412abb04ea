// Old cell files under tests/data/cells/version-0, each beside the diff of its migration and, where today's
// rules ask for more than a migration can know, the faults that are left.
#include "weldcell/files/cell_migration.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "weldcell/files/cell_file.hpp"

namespace weldcell::files {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

const std::string kOld = std::string(WELDCELL_TEST_DATA) + "/cells/version-0";
const std::string kRobots = std::string(WELDCELL_CONFIG) + "/robots";

std::string slurp(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

std::vector<fs::path> old_files() {
  std::vector<fs::path> out;
  for (const auto& entry : fs::directory_iterator(kOld)) {
    if (entry.path().extension() == ".yaml") out.push_back(entry.path());
  }
  std::ranges::sort(out);
  return out;
}

std::string faults_of(const std::string& cell) {
  const auto read = parse_cell(cell, "cell.yaml", kRobots);
  return std::holds_alternative<Faults>(read) ? text(std::get<Faults>(read)) : "";
}

/// Every value by its dotted key, for comparing what two files mean.
void flatten(const Node& node, const std::string& key, std::vector<std::string>& out) {
  if (node.kind == Node::Kind::Scalar) out.push_back(key + "=" + node.text);
  for (std::size_t i = 0; i < node.items.size(); ++i) {
    flatten(node.items[i], key + "." + (i < node.keys.size() ? node.keys[i].text : std::to_string(i)), out);
  }
}

std::vector<std::string> meaning(const std::string& text) {
  const auto parsed = parse_document(text, "cell.yaml");
  EXPECT_TRUE(std::holds_alternative<Node>(parsed)) << text;
  std::vector<std::string> out;
  if (const auto* node = std::get_if<Node>(&parsed)) flatten(*node, "", out);
  std::erase_if(out, [](const std::string& one) {
    return one.starts_with(".version=") || one.starts_with(".jobs.unsigned=");
  });
  return out;
}

TEST(CellMigration, EveryOldFileComesOutAsItsDiffSays) {
  const auto files = old_files();
  ASSERT_GE(files.size(), 8U);
  for (const fs::path& path : files) {
    SCOPED_TRACE(path.filename().string());
    const std::string before = slurp(path);
    EXPECT_THAT(faults_of(before), HasSubstr("weldcell migrate cell.yaml")) << "refused as it is";
    const auto migrated = migrate_cell(before, "cell.yaml");
    ASSERT_TRUE(migrated.ok()) << migrated.error().text();
    EXPECT_EQ(migrated->from, 0);
    EXPECT_EQ(migrated->diff, slurp(fs::path(path).replace_extension(".diff")));
    EXPECT_EQ(faults_of(migrated->text), slurp(fs::path(path).replace_extension(".faults")));
    EXPECT_EQ(meaning(migrated->text), meaning(before)) << "a migration changed what the file says";
    std::size_t comments = 0;
    std::istringstream lines(before);
    for (std::string line; std::getline(lines, line);) {
      const std::size_t at = line.find("# ");
      if (at == std::string::npos) continue;
      ++comments;
      EXPECT_THAT(migrated->text, HasSubstr(line.substr(at))) << "a comment was lost";
    }
    EXPECT_GT(comments, 0U);
    const auto again = migrate_cell(migrated->text, "cell.yaml");
    ASSERT_TRUE(again.ok()) << again.error().text();
    EXPECT_EQ(again->from, kCellVersion);
    EXPECT_EQ(again->text, migrated->text);
    EXPECT_EQ(again->diff, "");
  }
}

TEST(CellMigration, TheDeliveredFilesAreOfToday) {
  for (const char* name : {"/cell.yaml", "/cell-demo.yaml"}) {
    const auto read = migrate_cell(slurp(std::string(WELDCELL_CONFIG) + name), name);
    ASSERT_TRUE(read.ok()) << read.error().text();
    EXPECT_EQ(read->from, kCellVersion) << name;
    EXPECT_EQ(read->diff, "");
  }
}

TEST(CellMigration, RefusesInWords) {
  const struct {
    const char *text, *code, *says;
  } table[] = {
      {"version: 2\ncell: a\n", "cell.version",
       "c.yaml:1: version: 2 is newer than what this weldcell reads, 1"},
      {"cell: a\nversion: one\n", "cell.version", "c.yaml:2: version: is 'one'"},
      {"cell: a\nversion: 0.5\n", "cell.version", "write version: 1"},
      {"cell: a\nversion: -1\n", "cell.version", "write version: 1"},
      {"job: a\n", "cell.migrate", "is no cell file"},
      {"cell: [a\n", "cell.migrate", "is not valid YAML"},
      {"{cell: a}\n", "cell.migrate", "write one key a line"},
      {"cell: a\njobs: {signed_by: [x]}\n", "cell.migrate", "write one key a line"},
      {"cell: a\njobs: none\n", "cell.migrate", "jobs is no section"},
  };
  for (const auto& row : table) {
    const auto migrated = migrate_cell(row.text, "c.yaml");
    ASSERT_FALSE(migrated.ok()) << row.text;
    EXPECT_EQ(migrated.error().code, row.code) << row.text;
    EXPECT_THAT(migrated.error().text(), HasSubstr(row.says));
  }
}

TEST(CellMigration, ReadersNameTheCommandOrTheNewerProgram) {
  EXPECT_EQ(faults_of("cell: a\n"),
            "cell.yaml:1: version: is missing, so the file is of version 0, this weldcell reads 1: weldcell "
            "migrate cell.yaml shows what changes, with --write it changes it and keeps a backup\n");
  EXPECT_THAT(faults_of("version: 2\ncell: a\n"), HasSubstr("is 2, this weldcell reads 1: install the"));
  EXPECT_THAT(faults_of("version: '1a'\ncell: a\n"),
              HasSubstr("cell.yaml:1: version: is the quoted text '1a'"));
}

/// A table of changes to come, over two versions.
constexpr CellChange kLater[] = {
    {2, CellChange::Kind::Rename, "plc.timeout_s", "plc.heartbeat_timeout_s", ""},
    {2, CellChange::Kind::Rename, "cad", "cad_cache", ""},
    {3, CellChange::Kind::Drop, "weld.crater_s", "", "the controller's seam data has it"},
    {3, CellChange::Kind::State, "egm.filter", "low", "as before version 3"},
    {3, CellChange::Kind::Rename, "plc.heartbeat_timeout_s", "plc.silence_s", ""},
};

TEST(CellMigration, RenamesStatesAndDropsThroughSeveralVersions) {
  const std::string before =
      "version: 1  # old\ncell: a\nplc: {required: true, timeout_s: 3}  # timeout_s: as the PLC has it\n"
      "cad: here\nweld:\n  speed_mm_s: 10\n  crater_s: 2   # filled\negm:\n  # peer\n  cycle_ms: 4\n";
  const auto migrated = migrate_cell(before, "c.yaml", kLater);
  ASSERT_TRUE(migrated.ok()) << migrated.error().text();
  EXPECT_EQ(
      migrated->text,
      "version: 3  # old\ncell: a\nplc: {required: true, silence_s: 3}  # timeout_s: as the PLC has it\n"
      "cad_cache: here\nweld:\n  speed_mm_s: 10\n  # crater_s: 2   # filled  (the controller's seam data "
      "has it)\negm:\n  filter: low  # as before version 3\n  # peer\n  cycle_ms: 4\n");
  EXPECT_EQ(migrated->words.size(), 6U);
  const auto half = migrate_cell(
      "version: 2\ncell: a\nplc:\n  heartbeat_timeout_s: 3\negm:\n  filter: high\n", "c.yaml", kLater);
  ASSERT_TRUE(half.ok()) << half.error().text();
  EXPECT_EQ(half->from, 2);
  EXPECT_EQ(half->text, "version: 3\ncell: a\nplc:\n  silence_s: 3\negm:\n  filter: high\n");
  EXPECT_EQ(half->diff,
            "@@ -1,6 +1,6 @@\n-version: 2\n+version: 3\n cell: a\n plc:\n-  heartbeat_timeout_s: 3\n"
            "+  silence_s: 3\n egm:\n   filter: high\n");
}

TEST(CellMigration, ARenameThatIsNotPlainIsRefused) {
  for (const char* text : {"version: 1\ncell: a\nplc: {timeout_s: 3, x: {timeout_s: 4}}\n",
                           "version: 1\ncell: a\nplc:\n  timeout_s: 3\n  heartbeat_timeout_s: 3\n",
                           "version: 1\ncell: a\nweld: {crater_s: 2}\n"}) {
    const auto migrated = migrate_cell(text, "c.yaml", kLater);
    ASSERT_FALSE(migrated.ok()) << text;
    EXPECT_EQ(migrated.error().code, "cell.migrate");
    EXPECT_THAT(migrated.error().text(), HasSubstr("c.yaml:"));
  }
}

}  // namespace
}  // namespace weldcell::files
