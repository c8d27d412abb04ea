// Signatures that minisign 0.11 made, and what becomes of them with one byte changed anywhere.
#include "weldcell/adapters/signature_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

namespace weldcell::adapters {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

std::string slurp(const std::string& name) {
  std::ifstream in(std::string(WELDCELL_TEST_DATA) + "/minisign/" + name, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

wire::MinisignKey key(const std::string& name) {
  const std::string text = slurp(name);
  const std::size_t at = text.find('\n') + 1;
  const auto read = wire::minisign_key(text.substr(at, text.find('\n', at) - at));
  EXPECT_TRUE(read) << name;
  return read.value_or(wire::MinisignKey{});
}

const std::string kJob = slurp("job.yaml");
const std::string kSignature = slurp("job.yaml.minisig");

TEST(SignatureCheck, TakesWhatOneOfTheKeysSigned) {
  const std::vector keys{key("other.pub"), key("signer.pub")};
  const auto signer = check_signature(kJob, kSignature, keys);
  ASSERT_TRUE(signer.ok()) << signer.error().text();
  EXPECT_EQ(signer->key, keys[1].id);
  EXPECT_EQ(signer->comment, "line 3, shift 2");
  EXPECT_EQ(check_signature(kJob, slurp("legacy.minisig"), keys)->comment, "the older way");
  EXPECT_EQ(check_signature(kJob, slurp("other.minisig"), keys)->key, keys[0].id);
  EXPECT_TRUE(check_signature("", slurp("void.minisig"), keys).ok()) << "an empty file has a signature too";
}

TEST(SignatureCheck, NamesTheKeyThatIsNotAmongThem) {
  const std::vector keys{key("signer.pub")};
  const auto signer = check_signature(kJob, slurp("other.minisig"), keys);
  ASSERT_FALSE(signer.ok());
  EXPECT_EQ(signer.error().code, "signature.key");
  EXPECT_EQ(signer.error().what, "is signed by the key 87C3BFD5F8610A6B, allowed are: 384CD4C5D99AF531");
  EXPECT_EQ(check_signature(kJob, kSignature, {}).error().code, "signature.key");
  // Another key under the right one's name signs nothing.
  wire::MinisignKey masked = key("other.pub");
  masked.id = keys[0].id;
  EXPECT_EQ(check_signature(kJob, kSignature, std::vector{masked}).error().code, "signature.wrong");
}

TEST(SignatureCheck, OneByteOfTheJobChanged) {
  const std::vector keys{key("signer.pub")};
  for (const std::string& signature : {kSignature, slurp("legacy.minisig")}) {
    for (std::size_t at = 0; at < kJob.size(); ++at) {
      std::string job = kJob;
      job[at] = static_cast<char>(job[at] ^ 1);
      ASSERT_EQ(check_signature(job, signature, keys).error().code, "signature.wrong") << at;
    }
    EXPECT_FALSE(check_signature(kJob + " ", signature, keys).ok());
    EXPECT_FALSE(check_signature(kJob.substr(1), signature, keys).ok());
  }
  EXPECT_FALSE(check_signature(kJob, slurp("void.minisig"), keys).ok()) << "of another file";
}

TEST(SignatureCheck, OneByteOfTheSignatureChanged) {
  const std::vector keys{key("signer.pub")};
  const std::size_t counted = kSignature.find('\n');  // the untrusted comment is nobody's word
  int wrong = 0, form = 0, other_key = 0;
  for (std::size_t at = 0; at < kSignature.size(); ++at) {
    std::string changed = kSignature;
    changed[at] = static_cast<char>(changed[at] ^ 1);
    const auto signer = check_signature(kJob, changed, keys);
    if (at < counted && signer.ok()) continue;
    if (at + 1 == kSignature.size()) continue;  // the last line's end
    ASSERT_FALSE(signer.ok()) << at << " of " << changed;
    wrong += signer.error().code == "signature.wrong";
    form += signer.error().code == "signature.form";
    other_key += signer.error().code == "signature.key";
  }
  EXPECT_GT(wrong, 100);
  EXPECT_GT(form, 20);
  EXPECT_GT(other_key, 5);
}

TEST(SignatureCheck, AnAlteredTrustedCommentIsToldAsThat) {
  std::string changed = kSignature;
  changed.replace(changed.find("shift 2"), 7, "shift 3");
  const auto signer = check_signature(kJob, changed, std::vector{key("signer.pub")});
  ASSERT_FALSE(signer.ok());
  EXPECT_EQ(signer.error().code, "signature.wrong");
  EXPECT_THAT(signer.error().what, HasSubstr("trusted comment"));
}

TEST(SignatureFile, IsAPlainSmallFileOrNone) {
  char pattern[] = "/tmp/weldcell-signature-XXXXXX";
  const fs::path folder = ::mkdtemp(pattern);
  const auto read = [&](const char* name) { return read_signature_file((folder / name).string()); };
  EXPECT_FALSE(read("none")->has_value());
  std::ofstream(folder / "good") << kSignature;
  EXPECT_EQ(read("good")->value(), kSignature);
  std::ofstream(folder / "empty").flush();
  EXPECT_EQ(read("empty")->value(), "");
  std::ofstream(folder / "huge") << std::string(1'000'000, 'x');
  fs::create_symlink(folder / "good", folder / "link");
  fs::create_directory(folder / "folder");
  for (const char* bad : {"huge", "link", "folder"})
    EXPECT_EQ(read(bad).error().code, "signature.form") << bad;
  fs::remove_all(folder);
}

}  // namespace
}  // namespace weldcell::adapters
