// Every file of cases/ with a .expected beside it is refused with exactly that text. With
// WELDCELL_UPDATE_EXPECTED=1 the texts are written anew, to be read before they are committed.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "weldcell/adapters/cad_child.hpp"
#include "weldcell/files/check.hpp"

namespace weldcell {
namespace {

namespace fs = std::filesystem;

const std::string kCadProgram = std::string(WELDCELL_BIN) + "/weldcell-cad";

std::string slurp(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

adapters::CadRequest request_for(const fs::path& file) {
  adapters::CadRequest request;
  request.program = kCadProgram;
  request.file = file.string();
  fs::path options = file;
  std::ifstream in(options.replace_extension(".options"));
  std::string name, value;
  while (in >> name >> value) {
    if (name == "--height") request.options.height_mm = std::stod(value);
    if (name == "--radius") request.options.edge_radius_mm = std::stod(value);
    if (name == "--units") request.options.units = value;
  }
  return request;
}

/// What the user reads, "" when the file is taken.
std::string refusal(const fs::path& file) {
  if (file.extension() == ".yaml") {
    files::Checked checked = files::check_file(file.string());
    if (checked.faults.empty() && !checked.cad_file.empty()) {
      const auto read = adapters::import_cad_yaml(kCadProgram, checked.cad_file, checked.cad, "");
      if (!read.ok())
        checked.faults.push_back(
            {file.string(), checked.workpiece_line, "workpiece", read.error().text(), ""});
    }
    return files::text(checked.faults);
  }
  const auto read = adapters::import_cad_yaml(request_for(file));
  return read.ok() ? "" : read.error().text() + "\n";
}

std::vector<fs::path> cases() {
  std::vector<fs::path> out;
  for (const auto& entry : fs::directory_iterator(".")) {
    const std::string ending = entry.path().extension().string();
    if (ending != ".expected" && ending != ".options") out.push_back(entry.path().filename());
  }
  std::sort(out.begin(), out.end());
  return out;
}

/// Wherever this checkout lies, the expected text is the same.
std::string without(std::string text, const std::string& folder) {
  for (std::size_t at = text.find(folder); at != std::string::npos; at = text.find(folder))
    text.erase(at, folder.size());
  return text;
}

TEST(BadInput, IsRefusedWithTheTextThatMendsIt) {
  fs::current_path(BAD_INPUT_CASES);
  const bool update = std::getenv("WELDCELL_UPDATE_EXPECTED") != nullptr;
  int refused = 0;
  for (const fs::path& file : cases()) {
    SCOPED_TRACE(file.string());
    const std::string said = without(refusal(file), fs::current_path().string() + "/");
    if (file.string().rfind("sound-", 0) == 0) {
      EXPECT_EQ(said, "");
      continue;
    }
    fs::path expected = file;
    expected.replace_extension(".expected");
    if (update) std::ofstream(expected) << said;
    ASSERT_TRUE(fs::exists(expected)) << said;
    EXPECT_NE(said, "") << "taken instead of refused";
    EXPECT_EQ(said, slurp(expected));
    ++refused;
  }
  EXPECT_GE(refused, 82);
}

TEST(BadInput, OversizeIsRefused) {
  const fs::path folder = fs::temp_directory_path() / ("weldcell-bad-input-" + std::to_string(::getpid()));
  fs::create_directories(folder);
  const fs::path big = folder / "big.yaml";
  std::ofstream(big) << "job: big\n" << std::string(1'000'001, '#') << "\n";
  EXPECT_NE(refusal(big).find("is bigger than 1000000 bytes"), std::string::npos) << refusal(big);
  EXPECT_NE(refusal(folder / "gone.yaml").find("no such file"), std::string::npos);
  fs::create_directory(folder / "folder.yaml");
  EXPECT_NE(refusal(folder / "folder.yaml").find("is not a file"), std::string::npos);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace weldcell
