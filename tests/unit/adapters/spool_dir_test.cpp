// The spool on a real file system: what counts as whole, what a take moves, what a crash leaves, what is
// refused.
#include "weldcell/adapters/spool_dir.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <sstream>

#include "weldcell/adapters/fd.hpp"
#include "weldcell/adapters/host_clock.hpp"

namespace weldcell::adapters {
namespace {

namespace fs = std::filesystem;

constexpr const char* kJob = "job: demo\nworkpiece: ladder.step\n";

class Spool : public ::testing::Test {
 protected:
  void SetUp() override {
    char name[] = "/tmp/weldcell-spool-XXXXXX";
    ASSERT_NE(::mkdtemp(name), nullptr);
    root_ = name;
    options_.settle = 60 * kMillisecond;
    options_.lone_folder = 200 * kMillisecond;
    options_.unclosed = 3 * kSecond;
  }
  void TearDown() override { fs::remove_all(root_); }

  SpoolDir open() {
    auto spool = SpoolDir::open(root_, options_);
    EXPECT_TRUE(spool.ok()) << spool.error().text();
    return std::move(spool).value();
  }
  void write(const std::string& relative, const std::string& text) const {
    fs::create_directories((root_ / relative).parent_path());
    std::ofstream(root_ / relative) << text;
  }
  std::string read(const std::string& relative) const {
    std::ifstream in(root_ / relative);
    std::stringstream text;
    text << in.rdbuf();
    return in ? text.str() : "(none)";
  }
  bool has(const std::string& relative) const { return fs::exists(fs::symlink_status(root_ / relative)); }
  static SpoolEntry one(SpoolDir& spool) {
    auto entries = spool.poll(5 * kSecond);
    EXPECT_EQ(entries.size(), 1u);
    return entries.empty() ? SpoolEntry{} : entries.front();
  }

  fs::path root_;
  SpoolOptions options_;
};

TEST_F(Spool, MakesItsFoldersForOwnerAndGroupOnly) {
  fs::remove_all(root_);
  open();
  for (const char* place : {"incoming", "active", "done", "failed", "rejected"}) {
    struct stat facts {};
    ASSERT_EQ(::stat((root_ / place).c_str(), &facts), 0) << place;
    EXPECT_EQ(facts.st_mode & 0007, 0u) << place;
  }
}

TEST_F(Spool, TakesAFlatJobWithItsCad) {
  SpoolDir spool = open();
  write("incoming/ladder.step", "ISO-10303-21;");
  write("incoming/demo.yaml", kJob);
  const SpoolEntry entry = one(spool);
  EXPECT_EQ(entry.name, "demo.yaml");
  EXPECT_EQ(entry.problem, "");
  const std::string files[] = {"ladder.step"};
  const auto job = spool.take(entry, "demo-017", files);
  ASSERT_TRUE(job.ok()) << job.error().text();
  EXPECT_EQ(read("active/demo-017/demo.yaml"), kJob);
  EXPECT_EQ(read("active/demo-017/ladder.step"), "ISO-10303-21;");
  EXPECT_FALSE(has("incoming/demo.yaml"));
  EXPECT_FALSE(has("incoming/ladder.step"));
  EXPECT_EQ(job->job_file, fs::canonical(root_) / "active/demo-017/demo.yaml");
  EXPECT_TRUE(spool.poll(150 * kMillisecond).empty()) << "never offered twice";
  const auto done = spool.finish("demo-017", SpoolPlace::Done);
  ASSERT_TRUE(done.ok());
  EXPECT_EQ(read("done/demo-017/demo.yaml"), kJob);
  EXPECT_FALSE(has("active/demo-017"));
}

TEST_F(Spool, FindsWhatWasDroppedWhileNobodyWatched) {
  write("incoming/demo.yaml", kJob);
  SpoolDir spool = open();
  EXPECT_EQ(one(spool).name, "demo.yaml");
}

TEST_F(Spool, OldestFirst) {
  for (const char* name : {"incoming/b.yaml", "incoming/a.yaml", "incoming/c.yaml"}) {
    write(name, kJob);
    ::usleep(15'000);
  }
  SpoolDir spool = open();
  const auto entries = spool.poll(5 * kSecond);
  ASSERT_EQ(entries.size(), 3u);
  EXPECT_EQ(entries[0].name, "b.yaml");
  EXPECT_EQ(entries[1].name, "a.yaml");
  EXPECT_EQ(entries[2].name, "c.yaml");
}

TEST_F(Spool, AHalfWrittenFileIsWaitedFor) {
  SpoolDir spool = open();
  Fd writer(::open((root_ / "incoming/demo.yaml").c_str(), O_WRONLY | O_CREAT, 0640));
  ASSERT_EQ(::write(writer.get(), "job: de", 7), 7);
  EXPECT_TRUE(spool.poll(4 * options_.settle).empty()) << "its writer has not closed it";
  ASSERT_EQ(::write(writer.get(), "mo\n", 3), 3);
  EXPECT_TRUE(spool.poll(2 * options_.settle).empty());
  writer.reset();
  EXPECT_EQ(one(spool).name, "demo.yaml");
}

TEST_F(Spool, AFileThatGrowsFromOpeningToOpeningIsLeftAlone) {
  SpoolDir spool = open();
  for (int i = 0; i < 6; ++i) {
    std::ofstream(root_ / "incoming/demo.yaml", std::ios::app) << "# line\n";
    const auto entries = spool.poll(20 * kMillisecond);
    // A stall of this machine beyond the settling time makes an early offer right.
    if (!entries.empty()) GTEST_SKIP() << "the machine stalled";
  }
  EXPECT_EQ(one(spool).name, "demo.yaml");
}

TEST_F(Spool, ARenamedFileIsWholeAtOnceAndHiddenNamesAreNot) {
  options_.settle = 100 * kSecond;
  SpoolDir spool = open();
  write("incoming/.demo.yaml.tmp", kJob);
  write("incoming/half.yaml.part", kJob);
  EXPECT_TRUE(spool.poll(50 * kMillisecond).empty());
  fs::rename(root_ / "incoming/.demo.yaml.tmp", root_ / "incoming/demo.yaml");
  EXPECT_EQ(one(spool).name, "demo.yaml");
}

TEST_F(Spool, SubmitDropsAWholeFolder) {
  options_.settle = 100 * kSecond;
  SpoolDir spool = open();
  write("elsewhere/demo.yaml", kJob);
  write("elsewhere/cad/ladder.step", "ISO-10303-21;");
  const fs::path files[] = {root_ / "elsewhere/cad/ladder.step"};
  const auto dropped = submit_job(root_, root_ / "elsewhere/demo.yaml", files);
  ASSERT_TRUE(dropped.ok()) << dropped.error().text();
  EXPECT_EQ(submit_job(root_, root_ / "elsewhere/demo.yaml", files).error().code, "submit.duplicate");
  const SpoolEntry entry = one(spool);
  EXPECT_TRUE(entry.folder);
  EXPECT_EQ(entry.job_file.filename(), "demo.yaml");
  const std::string named[] = {"ladder.step"};
  ASSERT_TRUE(spool.take(entry, "demo", named).ok());
  EXPECT_EQ(read("active/demo/ladder.step"), "ISO-10303-21;");
  EXPECT_EQ(submit_job(root_, root_ / "elsewhere/none.yaml", {}).error().code, "submit.file");
  EXPECT_EQ(submit_job(root_ / "nowhere", root_ / "elsewhere/demo.yaml", {}).error().code, "submit.spool");
  for (const auto& left : fs::directory_iterator(root_ / "incoming")) ADD_FAILURE() << left.path();
}

TEST_F(Spool, WhatIsSubmittedBelongsToTheSpoolsGroup) {
  if (::geteuid() != 0) GTEST_SKIP() << "giving a folder to another group wants root";
  constexpr gid_t kGroup = 4242;
  SpoolDir spool = open();
  ASSERT_EQ(::chown((root_ / "incoming").c_str(), static_cast<uid_t>(-1), kGroup), 0);
  write("elsewhere/demo.yaml", kJob);
  const auto dropped = submit_job(root_, root_ / "elsewhere/demo.yaml", {});
  ASSERT_TRUE(dropped.ok()) << dropped.error().text();
  for (const fs::path& path : {*dropped, *dropped / "demo.yaml"}) {
    struct stat facts {};
    ASSERT_EQ(::stat(path.c_str(), &facts), 0);
    EXPECT_EQ(facts.st_gid, kGroup) << path;
    EXPECT_EQ(facts.st_mode & 0777, fs::is_directory(path) ? 0770U : 0660U) << path;
  }
}

TEST_F(Spool, AFolderCopiedFileByFileIsWaitedFor) {
  SpoolDir spool = open();
  fs::create_directory(root_ / "incoming/demo");
  write("incoming/demo/ladder.step", "ISO");
  EXPECT_TRUE(spool.poll(options_.settle).empty());
  write("incoming/demo/demo.yaml", kJob);
  write("incoming/demo/ladder-workpiece.yaml", "workpiece:\n  name: ladder\n");
  const SpoolEntry entry = one(spool);
  EXPECT_EQ(entry.name, "demo");
  EXPECT_EQ(entry.job_file.filename(), "demo.yaml");
  EXPECT_EQ(entry.problem, "");
}

TEST_F(Spool, ASharedWorkpieceStaysForTheOtherJob) {
  write("incoming/ladder.yaml", "# a workpiece\nworkpiece:\n  name: ladder\n");
  write("incoming/one.yaml", "job: one\nworkpiece: ladder.yaml\n");
  write("incoming/two.yaml", "job: two\nworkpiece: ladder.yaml\n");
  SpoolDir spool = open();
  const auto entries = spool.poll(5 * kSecond);
  ASSERT_EQ(entries.size(), 2u) << "the workpiece is no job";
  const std::string files[] = {"ladder.yaml"};
  ASSERT_TRUE(spool.take(entries[0], "one", files).ok());
  EXPECT_TRUE(has("incoming/ladder.yaml"));
  ASSERT_TRUE(spool.take(entries[1], "two", files).ok());
  EXPECT_FALSE(has("incoming/ladder.yaml"));
  EXPECT_EQ(read("active/one/ladder.yaml"), read("active/two/ladder.yaml"));
}

TEST_F(Spool, AMissingCadFileIsWaitedFor) {
  SpoolDir spool = open();
  write("incoming/demo.yaml", kJob);
  const SpoolEntry entry = one(spool);
  const std::string files[] = {"ladder.step"};
  EXPECT_EQ(spool.take(entry, "demo", files).error().code, "spool.missing");
  EXPECT_EQ(read("incoming/demo.yaml"), kJob) << "nothing was moved";
  EXPECT_FALSE(has("active/demo"));
  spool.put_back(entry);
  EXPECT_TRUE(spool.poll(50 * kMillisecond).empty()) << "not at once";
  write("incoming/ladder.step", "ISO");
  const SpoolEntry again = one(spool);
  EXPECT_GT(again.waited, 0);
  EXPECT_TRUE(spool.take(again, "demo", files).ok());
}

TEST_F(Spool, AJobNeverRunsTwice) {
  SpoolDir spool = open();
  for (const char* place : {"active", "done", "failed"}) {
    fs::create_directories(root_ / place / "demo");
    write("incoming/demo.yaml", kJob);
    const SpoolEntry entry = one(spool);
    const auto taken = spool.take(entry, "demo", {});
    ASSERT_FALSE(taken.ok());
    EXPECT_EQ(taken.error().code, "spool.duplicate");
    EXPECT_NE(taken.error().text().find(place), std::string::npos) << taken.error().text();
    EXPECT_NE(taken.error().mend.find("another name"), std::string::npos);
    ASSERT_TRUE(spool.reject(entry, taken.error().text()).ok());
    fs::remove_all(root_ / place / "demo");
  }
  EXPECT_EQ(read("rejected/demo.yaml"), kJob);
  EXPECT_EQ(read("rejected/demo-2.yaml"), kJob);
  EXPECT_EQ(read("rejected/demo-3.yaml"), kJob);
  EXPECT_NE(read("rejected/demo-2.yaml.reason").find("is done already"), std::string::npos)
      << read("rejected/demo-2.yaml.reason");
}

TEST_F(Spool, NothingLeadsOutOfTheSpool) {
  write("secret.step", "secret");
  SpoolDir spool = open();
  fs::create_symlink(root_ / "secret.step", root_ / "incoming/link.step");
  fs::create_directory(root_ / "incoming/.hidden");
  write("incoming/demo.yaml", kJob);
  const auto found = spool.poll(5 * kSecond);
  SpoolEntry entry;
  for (const SpoolEntry& one : found)
    if (one.name == "demo.yaml") entry = one;
  for (int i = 0; i < 3 && entry.name.empty(); ++i)
    for (const SpoolEntry& one : spool.poll(5 * kSecond))
      if (one.name == "demo.yaml") entry = one;
  ASSERT_EQ(entry.name, "demo.yaml");
  for (const std::string& file : {std::string("../secret.step"), (root_ / "secret.step").string(),
                                  std::string("link.step"), std::string(""), std::string(".hidden"),
                                  std::string("demo.yaml"), std::string("a/../../secret.step")}) {
    const std::string files[] = {file};
    const auto taken = spool.take(entry, "demo", files);
    ASSERT_FALSE(taken.ok()) << file;
    EXPECT_EQ(taken.error().code, "spool.path") << file;
  }
  for (const char* name : {"", "..", ".x", "a/b", "a b", "\xC3\xA4", "x\ny"}) {
    const auto taken = spool.take(entry, name, {});
    ASSERT_FALSE(taken.ok()) << name;
    EXPECT_EQ(taken.error().code, "spool.name") << name;
  }
  EXPECT_EQ(read("incoming/demo.yaml"), kJob);
  EXPECT_TRUE(fs::is_empty(root_ / "active"));
}

TEST_F(Spool, WhatCannotBeAJobIsOfferedWithItsProblem) {
  options_.max_job_bytes = 100;
  write("target.yaml", kJob);
  write("incoming/notes.txt", "hello");
  write("incoming/large.yaml", std::string(200, '#'));
  write("incoming/two/a.yaml", "job: a\n");
  write("incoming/two/b.yaml", "job: b\n");
  write("incoming/none/ladder.step", "ISO");
  write("incoming/linked/a.yaml", "job: a\n");
  fs::create_symlink(root_ / "target.yaml", root_ / "incoming/linked/ladder.step");
  fs::create_symlink(root_ / "target.yaml", root_ / "incoming/link.yaml");
  ASSERT_EQ(::mkfifo((root_ / "incoming/pipe.yaml").c_str(), 0640), 0);
  SpoolDir spool = open();
  std::map<std::string, SpoolEntry> found;
  for (int i = 0; i < 50 && found.size() < 7; ++i)
    for (const SpoolEntry& entry : spool.poll(kSecond)) found[entry.name] = entry;
  ASSERT_EQ(found.size(), 7u);
  EXPECT_NE(found["notes.txt"].problem.find("no job"), std::string::npos);
  EXPECT_NE(found["large.yaml"].problem.find("larger"), std::string::npos);
  EXPECT_NE(found["two"].problem.find("2 job files"), std::string::npos);
  EXPECT_NE(found["none"].problem.find("no job file"), std::string::npos);
  EXPECT_NE(found["linked"].problem.find("ladder.step"), std::string::npos);
  EXPECT_NE(found["link.yaml"].problem.find("link"), std::string::npos);
  EXPECT_NE(found["pipe.yaml"].problem.find("neither"), std::string::npos);
  for (const auto& [name, entry] : found) ASSERT_TRUE(spool.reject(entry, entry.problem).ok()) << name;
  EXPECT_TRUE(fs::is_empty(root_ / "incoming"));
  EXPECT_EQ(read("target.yaml"), kJob) << "the link went, not what it points at";
  EXPECT_EQ(read("rejected/two/a.yaml"), "job: a\n");
  EXPECT_NE(read("rejected/two.reason").find("2 job files"), std::string::npos);
  const auto listed = spool.list();
  EXPECT_EQ(std::count_if(
                listed.begin(), listed.end(),
                [](const SpoolJob& job) { return job.place == SpoolPlace::Rejected && !job.reason.empty(); }),
            7);
}

TEST_F(Spool, ActiveJobsAreFoundAfterAKill) {
  {
    SpoolDir spool = open();
    write("incoming/demo.yaml", kJob);
    ASSERT_TRUE(spool.take(one(spool), "demo-1", {}).ok());
  }
  const SpoolDir spool = open();
  const auto active = spool.active();
  ASSERT_EQ(active.size(), 1u);
  EXPECT_EQ(active[0].name, "demo-1");
  EXPECT_EQ(active[0].job_file.filename(), "demo.yaml");
}

/// What the file system looks like after each step of a take, were the process killed there.
TEST_F(Spool, ATakeThatWasCutIsEndedOrUndone) {
  open();
  // Killed while copying: the job file is still in incoming/.
  write("incoming/first.yaml", "job: first\n");
  write("incoming/a.step", "A");
  write("active/.take-first/a.step", "A");
  // Killed after the job file was moved: the take happened.
  write("active/.take-second/b.step", "B");
  write("active/.take-second/.job", "second.yaml");
  write("active/.take-second/second.yaml", "job: second\n");
  SpoolDir spool = open();
  EXPECT_FALSE(has("active/.take-first"));
  EXPECT_FALSE(has("active/.take-second"));
  const auto active = spool.active();
  ASSERT_EQ(active.size(), 1u);
  EXPECT_EQ(active[0].name, "second");
  EXPECT_EQ(active[0].job_file.filename(), "second.yaml");
  EXPECT_EQ(read("active/second/b.step"), "B");
  const SpoolEntry entry = one(spool);
  EXPECT_EQ(entry.name, "first.yaml");
  const std::string files[] = {"a.step"};
  EXPECT_TRUE(spool.take(entry, "first", files).ok());
}

TEST_F(Spool, FinishNeverOverwrites) {
  SpoolDir spool = open();
  write("active/demo/demo.yaml", kJob);
  write("failed/demo/old.txt", "old");
  const auto finished = spool.finish("demo", SpoolPlace::Failed);
  ASSERT_TRUE(finished.ok());
  EXPECT_EQ(finished->name, "demo-2");
  EXPECT_EQ(read("failed/demo/old.txt"), "old");
  EXPECT_EQ(spool.finish("demo", SpoolPlace::Done).error().code, "spool.missing");
  EXPECT_EQ(spool.finish("../incoming", SpoolPlace::Done).error().code, "spool.missing");
}

TEST_F(Spool, ThousandsOfFilesAreTakenInOneLook) {
  for (int i = 0; i < 2000; ++i)
    write("incoming/j" + std::to_string(i) + ".yaml", "job: j" + std::to_string(i) + "\n");
  SpoolDir spool = open();
  std::size_t found = 0;
  for (int i = 0; i < 10 && found < 2000; ++i) found += spool.poll(5 * kSecond).size();
  EXPECT_EQ(found, 2000u);
}

TEST_F(Spool, SaysWhyItCannotOpen) {
  write("file", "x");
  const auto spool = SpoolDir::open(root_ / "file", options_);
  ASSERT_FALSE(spool.ok());
  EXPECT_EQ(spool.error().code, "spool.io");
}

}  // namespace
}  // namespace weldcell::adapters
