// The service manager's protocol against a socket that plays systemd; secrets from credentials and files;
// process facts.
#include "weldcell/adapters/systemd.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "weldcell/adapters/fd.hpp"
#include "weldcell/adapters/process_facts.hpp"

namespace weldcell::adapters {
namespace {

namespace fs = std::filesystem;

class Service : public ::testing::Test {
 protected:
  void SetUp() override {
    char name[] = "/tmp/weldcell-systemd-XXXXXX";
    ASSERT_NE(::mkdtemp(name), nullptr);
    folder_ = name;
  }
  void TearDown() override {
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID", "CREDENTIALS_DIRECTORY"})
      ::unsetenv(name);
    fs::remove_all(folder_);
  }
  fs::path folder_;
};

TEST_F(Service, NobodyListensWithoutSystemd) {
  ::unsetenv("NOTIFY_SOCKET");
  EXPECT_FALSE(notify_ready("ready"));
  EXPECT_FALSE(notify_watchdog());
  EXPECT_FALSE(watchdog_interval());
  EXPECT_TRUE(listen_sockets().empty());
}

TEST_F(Service, SendsWhatSystemdReads) {
  const Fd manager(::socket(AF_UNIX, SOCK_DGRAM, 0));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string path = folder_ / "notify";
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(::bind(manager.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  ::setenv("NOTIFY_SOCKET", path.c_str(), 1);
  const auto received = [&] {
    char text[512];
    const ssize_t n = ::recv(manager.get(), text, sizeof text, MSG_DONTWAIT);
    return n < 0 ? std::string("(nothing)") : std::string(text, static_cast<std::size_t>(n));
  };
  EXPECT_TRUE(notify_ready("waiting for jobs"));
  EXPECT_EQ(received(), "READY=1\nSTATUS=waiting for jobs");
  EXPECT_TRUE(notify_status("job a\nREADY=0"));
  EXPECT_EQ(received(), "STATUS=job a READY=0") << "a text cannot speak the protocol";
  EXPECT_TRUE(notify_watchdog());
  EXPECT_EQ(received(), "WATCHDOG=1");
  EXPECT_TRUE(notify_stopping("bringing the robot to rest"));
  EXPECT_EQ(received(), "STOPPING=1\nSTATUS=bringing the robot to rest");
  EXPECT_TRUE(notify_reloading());
  EXPECT_TRUE(received().starts_with("RELOADING=1\nMONOTONIC_USEC="));
}

TEST_F(Service, WatchdogIntervalIsForThisProcess) {
  ::setenv("WATCHDOG_USEC", "2000000", 1);
  ASSERT_TRUE(watchdog_interval());
  EXPECT_EQ(*watchdog_interval(), 2 * kSecond);
  ::setenv("WATCHDOG_PID", "1", 1);
  EXPECT_FALSE(watchdog_interval());
}

TEST_F(Service, CredentialsComeFromTheManagersFolder) {
  EXPECT_EQ(credential("rws-password").error().code, "credential.absent");
  ::setenv("CREDENTIALS_DIRECTORY", folder_.c_str(), 1);
  EXPECT_EQ(credential("rws-password").error().code, "credential.absent");
  std::ofstream(folder_ / "rws-password") << "robotics\n";
  ASSERT_TRUE(credential("rws-password").ok());
  EXPECT_EQ(credential("rws-password").value(), "robotics");
  for (const char* name : {"", "../rws-password", ".", "a/b"})
    EXPECT_EQ(credential(name).error().code, "credential.name") << name;
  fs::create_directory(folder_ / "folder");
  EXPECT_EQ(credential("folder").error().code, "credential.unreadable");
}

TEST_F(Service, ASecretThatEverybodyMayReadIsRefused) {
  const std::string path = folder_ / "password";
  std::ofstream(path) << "robotics";
  ::chmod(path.c_str(), 0644);
  const auto open = secret_file(path);
  ASSERT_FALSE(open.ok());
  EXPECT_EQ(open.error().code, "credential.mode");
  EXPECT_EQ(open.error().text().find("robotics"), std::string::npos);
  ::chmod(path.c_str(), 0600);
  EXPECT_EQ(secret_file(path).value(), "robotics");
}

TEST(ProcessFacts, AreThoseOfThisProcess) {
  EXPECT_GT(rss_kb(), 1000);
  EXPECT_GE(peak_rss_kb(), rss_kb() / 2);
  EXPECT_GT(cpu_seconds(), 0);
  EXPECT_GE(thread_count(), 1);
}

}  // namespace
}  // namespace weldcell::adapters
