// What a command line says to a word that it does not know.
#include "app/command_line.hpp"

#include <gtest/gtest.h>

namespace weldcell::app {

namespace {

/// What the words are refused with; empty when they are taken.
std::string refusal(const std::vector<const char*>& words) {
  testing::internal::CaptureStderr();
  const CommandLine line(Arguments(words.data(), words.size()), "usage\n", {"workpiece", "seed"}, {"json"});
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_EQ(line.exit_code().value_or(0), said.empty() ? 0 : 2);
  return said;
}

}  // namespace

TEST(CommandLine, NamesTheOptionThatWasMeant) {
  EXPECT_EQ(refusal({"--workpeice", "x"}),
            "unknown option '--workpeice': did you mean '--workpiece'?; try --help\n");
  EXPECT_EQ(refusal({"--jason"}), "unknown option '--jason': did you mean '--json'?; try --help\n");
  EXPECT_EQ(refusal({"--zebra"}), "unknown option '--zebra'; try --help\n");
  EXPECT_EQ(refusal({"--seed"}), "--seed wants a value; try --help\n");
  EXPECT_EQ(refusal({"--seed", "3", "--json", "plain"}), "");
}

}  // namespace weldcell::app
