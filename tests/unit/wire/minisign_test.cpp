// The form of minisign's texts, against files that minisign 0.11 wrote (tests/data/minisign).
#include "weldcell/wire/minisign.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

namespace weldcell::wire {
namespace {

using ::testing::HasSubstr;

std::string slurp(const std::string& name) {
  std::ifstream in(std::string(WELDCELL_TEST_DATA) + "/minisign/" + name, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

std::string key_line(const std::string& name) {
  const std::string text = slurp(name);
  const std::size_t at = text.find('\n') + 1;
  return text.substr(at, text.find('\n', at) - at);
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(Minisign, ReadsAKeyAndNamesItAsTheProgramDoes) {
  const auto key = minisign_key(key_line("signer.pub"));
  ASSERT_TRUE(key);
  EXPECT_EQ(to_string(key->id), "384CD4C5D99AF531");
  EXPECT_THAT(slurp("signer.pub"), HasSubstr(to_string(key->id)));
}

TEST(Minisign, AnythingElseIsNoKey) {
  const std::string good = key_line("signer.pub");
  for (const std::string& bad : {std::string(), good.substr(1), good + "A", good + "\n", " " + good,
                                 std::string(56, 'A'), replaced(good, "RWQ", "RUQ"), replaced(good, "x", "-"),
                                 good.substr(0, 55) + "=", slurp("signer.pub")})
    EXPECT_FALSE(minisign_key(bad)) << bad;
  EXPECT_TRUE(looks_like_minisign_secret("RWRTY0Iy" + std::string(204, 'A')));
  EXPECT_TRUE(looks_like_minisign_secret("RWQAAEIy" + std::string(204, 'A')));
  EXPECT_FALSE(looks_like_minisign_secret(good));
}

TEST(Minisign, ReadsBothKindsOfSignature) {
  const auto now = minisign_signature(slurp("job.yaml.minisig"));
  ASSERT_TRUE(now.ok()) << now.error().text();
  EXPECT_TRUE(now->prehashed);
  EXPECT_EQ(to_string(now->key), "384CD4C5D99AF531");
  EXPECT_EQ(now->trusted_comment, "line 3, shift 2");
  const auto legacy = minisign_signature(slurp("legacy.minisig"));
  ASSERT_TRUE(legacy.ok()) << legacy.error().text();
  EXPECT_FALSE(legacy->prehashed);
  EXPECT_EQ(legacy->trusted_comment, "the older way");
}

TEST(Minisign, LineEndsOfAnotherSystemAreNotSigned) {
  std::string text;
  for (const char c : slurp("job.yaml.minisig")) text += c == '\n' ? std::string("\r\n") : std::string(1, c);
  const auto read = minisign_signature(text);
  ASSERT_TRUE(read.ok()) << read.error().text();
  EXPECT_EQ(read->trusted_comment, "line 3, shift 2");
  EXPECT_TRUE(minisign_signature(text.substr(0, text.size() - 2)).ok()) << "without an end of the last line";
}

TEST(Minisign, AnythingElseIsNoSignature) {
  const std::string good = slurp("job.yaml.minisig");
  const struct {
    std::string text, says;
  } table[] = {
      {"", "is empty"},
      {std::string(kMinisignMostBytes + 1, 'x'), "no signature is so long"},
      {"job: a\n", "untrusted comment"},
      {"untrusted comment: x\n", "second line"},
      {replaced(good, "RUQ", "RXQ"), "algorithm"},
      {replaced(good, "RUQ", "RUQQ"), "second line"},
      {replaced(good, "27gw=", "27gx="), "second line"},  // bits that no byte has
      {replaced(good, "trusted comment: line", "comment: line"), "trusted comment"},
      {good.substr(0, good.find("emFv")), "fourth line"},
      {replaced(good, "4Cw==", "4Cw="), "fourth line"},
      {good + "more\n", "behind its fourth line"},
      {good + good, "behind its fourth line"},
  };
  for (const auto& row : table) {
    const auto read = minisign_signature(row.text);
    ASSERT_FALSE(read.ok()) << row.text;
    EXPECT_EQ(read.error().code, "signature.form");
    EXPECT_THAT(read.error().what, HasSubstr(row.says)) << row.text;
  }
}

}  // namespace
}  // namespace weldcell::wire
