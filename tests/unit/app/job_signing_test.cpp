// What the cell file says of unsigned jobs, and what becomes of a job by it.
#include "app/job_signing.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

namespace weldcell::app {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

std::string slurp(const std::string& name) {
  std::ifstream in(std::string(WELDCELL_TEST_DATA) + "/minisign/" + name, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

class JobSigning : public ::testing::Test {
 protected:
  void SetUp() override {
    char pattern[] = "/tmp/weldcell-signing-XXXXXX";
    folder_ = ::mkdtemp(pattern);
    job_ = (folder_ / "job.yaml").string();
    write("job.yaml", slurp("job.yaml"));
    const std::string text = slurp("signer.pub");
    const std::size_t at = text.find('\n') + 1;
    config_.job_keys = {*wire::minisign_key(text.substr(at, text.find('\n', at) - at))};
    config_.unsigned_refused = true;
  }
  void TearDown() override { fs::remove_all(folder_); }
  void write(const std::string& name, const std::string& text) { std::ofstream(folder_ / name) << text; }
  std::string code() {
    const auto read = read_job(job_, config_);
    return read.ok() ? "" : read.error().code;
  }
  std::string words() { return read_job(job_, config_).error().text(); }

  fs::path folder_;
  std::string job_;
  files::CellConfig config_;
};

TEST_F(JobSigning, ASignedJobNamesItsSigner) {
  write("job.yaml.minisig", slurp("job.yaml.minisig"));
  const auto read = read_job(job_, config_);
  ASSERT_TRUE(read.ok()) << read.error().text();
  EXPECT_EQ(read->order.name, "signed-1");
  EXPECT_EQ(read->text, slurp("job.yaml"));
  EXPECT_EQ(read->signer, "signed by the key 384CD4C5D99AF531, trusted comment 'line 3, shift 2'");
  EXPECT_TRUE(read->signature_there);
}

TEST_F(JobSigning, WithoutASignatureItIsRefusedOrTaken) {
  EXPECT_EQ(code(), "job.unsigned");
  EXPECT_THAT(words(), HasSubstr("minisign -Sm job.yaml"));
  EXPECT_THAT(words(), HasSubstr("the signature first"));
  config_.unsigned_refused = false;
  EXPECT_EQ(code(), "");
  EXPECT_EQ(read_job(job_, config_)->signer, "");
}

TEST_F(JobSigning, ABadSignatureIsRefusedEvenWhereNoneIsNeeded) {
  config_.unsigned_refused = false;
  for (const char* bad : {"other.minisig", "void.minisig", "signer.pub"}) {
    write("job.yaml.minisig", slurp(bad));
    EXPECT_EQ(code(), "job.signature") << bad;
    EXPECT_THAT(words(), HasSubstr("job.yaml.minisig")) << bad;
  }
  write("job.yaml.minisig", "");
  EXPECT_EQ(code(), "job.signature");
  EXPECT_THAT(words(), HasSubstr("is empty"));
  write("job.yaml.minisig", std::string(1'000'000, 'x'));
  EXPECT_THAT(words(), HasSubstr("10 kB"));
  config_.job_keys.clear();
  fs::remove(folder_ / "job.yaml.minisig");
  write("job.yaml.minisig", "anything");
  EXPECT_EQ(code(), "") << "no key is named: nothing can be checked";
  EXPECT_TRUE(read_job(job_, config_)->signature_there);
}

TEST_F(JobSigning, AnAlteredJobIsRefusedBeforeItIsParsed) {
  write("job.yaml.minisig", slurp("job.yaml.minisig"));
  write("job.yaml", slurp("job.yaml") + "planned: {x_mm: 1\n");
  EXPECT_EQ(code(), "job.signature");
  EXPECT_THAT(words(), HasSubstr("it was changed since"));
}

TEST_F(JobSigning, ASignatureThatDoesNotBindTheWorkpieceIsNotEnough) {
  write("job.yaml", slurp("no-revision.yaml"));
  write("job.yaml.minisig", slurp("no-revision.yaml.minisig"));
  EXPECT_EQ(code(), "job.signature");
  EXPECT_THAT(words(), HasSubstr("revision: is missing"));
}

TEST_F(JobSigning, FaultsOfAJobThatNobodySignsAreToldAsEver) {
  config_.unsigned_refused = false;
  write("job.yaml", "job: a\nworkpeace: b.yaml\n");
  EXPECT_EQ(code(), "job.file");
  EXPECT_THAT(words(), HasSubstr("job.yaml:2: workpeace: unknown key: did you mean 'workpiece'?"));
}

}  // namespace
}  // namespace weldcell::app
