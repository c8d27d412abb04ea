// docs/SIMULATOR.md names a test for each behaviour: the tests must exist.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

namespace weldcell::sim {
namespace {

std::string text_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::set<std::string> matches(const std::string& text, const std::regex& pattern) {
  std::set<std::string> out;
  for (std::sregex_iterator m(text.begin(), text.end(), pattern), end; m != end; ++m)
    out.insert((*m)[1].str() + "." + (*m)[2].str());
  return out;
}

TEST(SimulatorTable, NamesTestsThatExist) {
  const std::filesystem::path tests = std::filesystem::path(WELDCELL_TEST_DATA).parent_path();
  std::set<std::string> there;
  const std::regex test("TEST(?:_P|_F)?\\((\\w+),\\s*(\\w+)\\)");
  for (const auto& file : std::filesystem::recursive_directory_iterator(tests / "unit")) {
    if (file.path().extension() == ".cpp") there.merge(matches(text_of(file.path()), test));
  }
  const auto named =
      matches(text_of(tests.parent_path() / "docs/SIMULATOR.md"), std::regex("`([A-Z]\\w+)\\.(\\w+)`"));
  EXPECT_GT(named.size(), 40U);
  for (const std::string& name : named) EXPECT_TRUE(there.contains(name)) << name;
}

}  // namespace
}  // namespace weldcell::sim
