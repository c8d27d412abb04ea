// The journal's file: order, durability calls and a full disk.
#include "weldcell/adapters/journal_file.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <random>
#include <sstream>

namespace weldcell::adapters {
namespace {

namespace fs = std::filesystem;

class Journal : public ::testing::Test {
 protected:
  void SetUp() override {
    char name[] = "/tmp/weldcell-journal-XXXXXX";
    ASSERT_NE(::mkdtemp(name), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string content(const char* name) const {
    std::ifstream in(folder_ / name, std::ios::binary);
    std::stringstream text;
    text << in.rdbuf();
    return text.str();
  }
  fs::path folder_;
};

std::span<const std::byte> bytes(const std::string& text) { return std::as_bytes(std::span(text)); }

TEST_F(Journal, KeepsEveryByteInOrderWhateverThePieces) {
  constexpr unsigned kSeed = 7;
  std::mt19937 random(kSeed);
  auto file = JournalFile::create(folder_ / "a.mcap", 1000);
  ASSERT_TRUE(file.ok());
  std::string expected;
  for (int i = 0; i < 500; ++i) {
    std::string piece(random() % 2500, '\0');
    for (char& c : piece) c = static_cast<char>(random());
    (*file)->write(bytes(piece));
    expected += piece;
    if (i % 50 == 0) {
      ASSERT_TRUE((*file)->flush(false));
      ASSERT_EQ(content("a.mcap"), expected) << "seed " << kSeed << " piece " << i;
    }
  }
  EXPECT_TRUE((*file)->close());
  EXPECT_EQ(content("a.mcap"), expected) << "seed " << kSeed;
  EXPECT_EQ((*file)->bytes_written(), expected.size());
  EXPECT_FALSE((*file)->take_fault());
}

TEST_F(Journal, NeverOverwritesARecord) {
  std::ofstream(folder_ / "a.mcap") << "old";
  EXPECT_EQ(JournalFile::create(folder_ / "a.mcap").error().code, "journal.exists");
  EXPECT_EQ(JournalFile::create(folder_ / "none/a.mcap").error().code, "journal.open");
  EXPECT_EQ(content("a.mcap"), "old");
}

TEST_F(Journal, AFullDiskIsToldOnceAndLeavesAPrefix) {
  auto file = JournalFile::create(folder_ / "a.mcap", 100);
  ASSERT_TRUE(file.ok());
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = ::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{1000, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  std::string all;
  for (int i = 0; i < 40; ++i) {
    const std::string piece(64, static_cast<char>('a' + i % 26));
    (*file)->write(bytes(piece));
    all += piece;
  }
  const bool flushed = (*file)->flush(true);
  ::setrlimit(RLIMIT_FSIZE, &before);
  ::signal(SIGXFSZ, handler);
  EXPECT_FALSE(flushed);
  const auto fault = (*file)->take_fault();
  ASSERT_TRUE(fault);
  EXPECT_EQ(fault->code, "journal.disk_full");
  EXPECT_NE(fault->what.find("after 1000 bytes"), std::string::npos) << fault->text();
  EXPECT_FALSE((*file)->take_fault()) << "once";
  (*file)->write(bytes("more"));
  EXPECT_FALSE((*file)->close());
  EXPECT_EQ(content("a.mcap"), all.substr(0, 1000));
}

}  // namespace
}  // namespace weldcell::adapters
